//! `bagtrack completions`: a script that completes commands and flags in a shell.

use bagtrack_cli::output;
use clap::Command;
use clap_complete::Shell;
use std::error::Error;

/// Flags of `completions`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell: `source <(bagtrack completions bash)`, or a file where the shell looks for such scripts.
    shell: Shell,
}

/// Prints the script for these commands.
pub fn run(args: Args, mut command: Command) -> Result<(), Box<dyn Error>> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "bagtrack", &mut script);
    Ok(output::print(&String::from_utf8(script)?)?)
}
