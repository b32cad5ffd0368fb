//! Timing on a shared machine: compared actions take turns, the median is reported, and time is the thread's or a
//! process's processor time, which excludes other processes.

use rustix::time::{ClockId, Timespec, clock_gettime};

/// A piece of work to time.
pub type Action<'a> = Box<dyn FnMut() + 'a>;

/// Calls each action `rounds` times, in turns. Returns the median time of each in seconds.
pub fn medians(rounds: usize, actions: Vec<Action<'_>>) -> Vec<f64> {
    cycles(rounds, 1, actions)
}

/// Like [`medians`], for actions of which every `period`-th call has more to do: makes `rounds` times `period` calls of
/// each. Returns for each action the median of each call of a period over the rounds, averaged over the period. So rare
/// work counts, and other work on the machine does not.
pub fn cycles(rounds: usize, period: usize, mut actions: Vec<Action<'_>>) -> Vec<f64> {
    let mut times = vec![vec![Vec::with_capacity(rounds); period]; actions.len()];
    for call in 0..rounds * period {
        for (action, times) in actions.iter_mut().zip(&mut times) {
            let start = seconds();
            action();
            times[call % period].push(seconds() - start);
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    times
        .into_iter()
        .map(|calls| calls.into_iter().map(median).sum::<f64>() / period as f64)
        .collect()
}

/// Processor time of this thread.
fn seconds() -> f64 {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(ClockId::ThreadCPUTime);
    tv_sec as f64 + tv_nsec as f64 * 1e-9
}

/// Seconds of processor time that the threads of a process have used, to a hundredth (Linux only).
pub fn of_process(id: u32) -> f64 {
    let path = format!("/proc/{id}/stat");
    let stat = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    // The second field is the name of the program, in brackets; user and system time are the 12th and 13th after it.
    let (_, fields) = stat.rsplit_once(") ").expect("the name is in brackets");
    let ticks = fields.split(' ').skip(11).take(2);
    let ticks: u64 = ticks.filter_map(|field| field.parse::<u64>().ok()).sum();
    // Linux gives these times in hundredths of a second on every machine.
    ticks as f64 / 100.0
}
