//! Timing on a machine that others use too: things that are compared take turns, and the median counts.

use std::time::Instant;

/// What is timed.
pub type Action<'a> = Box<dyn FnMut() + 'a>;

/// Calls every one of `actions` `rounds` times, in turns; gives the median seconds of each.
pub fn medians(rounds: usize, mut actions: Vec<Action<'_>>) -> Vec<f64> {
    let mut times = vec![Vec::with_capacity(rounds); actions.len()];
    for _ in 0..rounds {
        for (action, times) in actions.iter_mut().zip(&mut times) {
            let start = Instant::now();
            action();
            times.push(start.elapsed().as_secs_f64());
        }
    }
    times
        .into_iter()
        .map(|mut times| {
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        })
        .collect()
}
