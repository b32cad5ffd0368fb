//! The commands of the program, one file each.
//!
//! In: flags and environment variables, read by clap. Out: standard output, new files, and an exit status: 0; 1 after
//! an error, which is one line on standard error; 2 from clap on wrong usage; 128 and the number of the signal that
//! ended `track`.

mod address;
#[cfg(feature = "tls")]
mod any_certificate;
mod completions;
mod confined;
mod evaluate;
#[cfg(feature = "otel")]
mod export;
mod health;
mod log;
mod memory_limit;
mod open_files;
mod sample;
mod serve;
mod signals;
mod track;
mod variables;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// Follows one object through frames: a service, and the same tracker on videos and folders of frames.
#[derive(Debug, Parser)]
#[command(
    name = "bagtrack",
    version,
    about,
    // A setting before the command would be silently dropped otherwise.
    args_conflicts_with_subcommands = true
)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Without a command, `serve` runs with these settings.
    #[command(flatten)]
    serve: serve::Args,
}

const AFTER: &str = "Without a command the service runs. It takes the settings of `bagtrack serve --help`, as flags or \
    as variables\nof the environment, and listens on http://127.0.0.1:8080.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the HTTP service (the default).
    Serve(Box<serve::Args>),
    /// Track through a video or a folder of frames.
    Track(track::Args),
    /// Measure accuracy and speed on annotated sequences, with the program `bagtrack-eval`.
    #[command(disable_help_flag = true)]
    Eval(evaluate::Args),
    /// Draw a synthetic clip with exact ground truth.
    Sample(sample::Args),
    /// Ask a running service whether it is healthy.
    Health(health::Args),
    /// Give up rights and become another program.
    #[command(hide = true, name = confined::NAME, disable_help_flag = true)]
    Confined(confined::Args),
    /// Print what completes commands and flags in a shell.
    Completions(completions::Args),
}

/// The commands. The settings of the service are in the help of `serve` only, so that the first help fits a screen.
fn command() -> clap::Command {
    let command = Cli::command().mut_args(|arg| arg.hide(true));
    variables::without_empty(command.after_help(AFTER))
}

/// Reads the command line.
pub fn parse() -> Cli {
    let matches = command().get_matches();
    Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

pub fn run(cli: Cli) -> ExitCode {
    let done = |()| ExitCode::SUCCESS;
    let result = match cli.command.unwrap_or(Command::Serve(Box::new(cli.serve))) {
        Command::Serve(args) => serve::run(*args).map(done),
        Command::Track(args) => track::run(args),
        Command::Eval(args) => evaluate::run(args).map(done),
        Command::Sample(args) => sample::run(args).map(done),
        Command::Health(args) => health::run(args).map(done),
        Command::Confined(args) => confined::run(args),
        Command::Completions(args) => completions::run(args, command()).map(done),
    };
    result.unwrap_or_else(|error| {
        eprintln!("bagtrack: {error}");
        ExitCode::FAILURE
    })
}
