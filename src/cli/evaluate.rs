//! `bagtrack eval`: hands over to the program `bagtrack-eval`.

use std::error::Error;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, exit};

const PROGRAM: &str = "bagtrack-eval";

/// What `bagtrack-eval` gets.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The arguments of `bagtrack-eval`.
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENTS"
    )]
    arguments: Vec<OsString>,
}

/// Runs `bagtrack-eval`, and ends with its exit status.
pub fn run(args: Args) -> Result<(), Box<dyn Error>> {
    let ended = Command::new(program()).args(args.arguments).status();
    let ended = ended.map_err(|error| {
        format!("{PROGRAM}: {error}; `cargo build --release` and `cargo install --path crates/eval` build it")
    })?;
    exit(ended.code().unwrap_or(1));
}

/// The program beside this one, or else the one on the path.
fn program() -> PathBuf {
    let this = std::env::current_exe().ok();
    let beside =
        this.map(|this| this.with_file_name(format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX)));
    beside
        .filter(|path| path.is_file())
        .unwrap_or_else(|| PROGRAM.into())
}
