//! The simulation is deterministic, and its first seeds hold.

use std::process::Command;

/// The output of `sim --trace` for this seed, run in another process.
fn trace_of_another_process(seed: u64) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sim"));
    command.args(["--seed", &seed.to_string(), "--trace"]);
    command.output().expect("it was built").stdout
}

#[test]
fn the_same_seed_gives_the_same_trace() {
    for seed in 0..12 {
        let outcome = sim::run(seed);
        assert!(outcome.answers > 0, "seed {seed} does nothing");
        assert!(outcome.trace == sim::run(seed).trace, "seed {seed} again");
        let other = trace_of_another_process(seed);
        assert!(
            other.starts_with(&outcome.trace),
            "seed {seed} in another process"
        );
    }
    assert_ne!(sim::run(1).trace, sim::run(2).trace);
}

#[test]
fn the_first_seeds_hold() {
    for seed in 0..40 {
        let outcome = sim::run(seed);
        assert!(
            outcome.faults.is_empty(),
            "seed {seed}: {:?}",
            outcome.faults
        );
    }
}
