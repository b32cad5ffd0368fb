//! Runs seeds, and tells the first that fails.

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

/// The service in a simulated world with faults.
#[derive(Debug, Parser)]
struct Args {
    /// Runs so many seeds
    #[arg(long, default_value_t = 100)]
    seeds: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Runs this seed alone
    #[arg(long, conflicts_with_all = ["seeds", "from"])]
    seed: Option<u64>,
    /// Goes on after a seed that fails
    #[arg(long)]
    all: bool,
    /// Plants each fault of a list in the code, and tells the first seed that finds it
    #[cfg(feature = "planted-faults")]
    #[arg(long)]
    planted: bool,
    /// Writes what happened
    #[arg(long, requires = "seed")]
    trace: bool,
}

fn main() -> ExitCode {
    let args = Args::parse();
    #[cfg(feature = "planted-faults")]
    if args.planted {
        return planted(args.seeds);
    }
    match args.seed {
        Some(seed) => one(seed, args.trace),
        None => many(args.from, args.seeds, args.all),
    }
}

fn one(seed: u64, with_trace: bool) -> ExitCode {
    let outcome = sim::run(seed);
    if with_trace {
        // A reader that has closed the pipe is no error.
        let _ = std::io::stdout().write_all(&outcome.trace);
    }
    println!("seed {seed}: {} frames answered", outcome.answers);
    report(&outcome)
}

fn many(from: u64, seeds: u64, all: bool) -> ExitCode {
    let (begin, mut answers, mut failed, mut run) = (Instant::now(), 0, 0, 0);
    for seed in from..from + seeds {
        let outcome = sim::run(seed);
        (answers, run) = (answers + outcome.answers, run + 1);
        if !outcome.faults.is_empty() {
            failed += 1;
            println!("seed {seed} fails; to see how: cargo run -p sim -- --seed {seed} --trace");
            report(&outcome);
            if !all {
                break;
            }
        }
    }
    let rate = f64::from(run) / begin.elapsed().as_secs_f64();
    println!(
        "{run} seeds from {from}, {answers} frames answered, {failed} failed: {rate:.1} seeds a second"
    );
    match failed {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

#[cfg(feature = "planted-faults")]
fn planted(seeds: u64) -> ExitCode {
    let mut are_found = true;
    for fault in bagtrack_sessions::PlantedFault::ALL {
        match sim::finds(fault, seeds) {
            Some(found) => println!("{fault:?}: seed {}: {}", found.seed, found.faults[0]),
            None => {
                println!("{fault:?}: not found by {seeds} seeds");
                are_found = false;
            }
        }
    }
    match are_found {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

fn report(outcome: &sim::Outcome) -> ExitCode {
    for fault in &outcome.faults {
        println!("{fault}");
    }
    match outcome.faults.is_empty() {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}
