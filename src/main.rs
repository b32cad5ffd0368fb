//! The command line: `serve` (the default), `track`, `eval`, `sample`, `health`, `completions`.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run(cli::parse())
}
