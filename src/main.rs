//! The command line: `serve` (the default), `track`, `eval`, `sample`, `health`.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run(cli::Cli::parse())
}
