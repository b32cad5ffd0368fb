//! The commands of the program, one file each.
//!
//! In: flags and environment variables, read by clap. Out: standard output, new folders, and an exit status: 0, or 1
//! after an error that is printed as one line on standard error, or 2 from clap on wrong usage.

mod draw;
mod evaluate;
#[cfg(feature = "otel")]
mod export;
mod health;
mod log;
mod open_files;
mod sample;
mod serve;
mod signals;
mod track;
mod track_frames;
mod track_writer;

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
}

/// Reads the command line. The settings of the service are in the help of `serve` only, so that this one fits a screen.
pub fn parse() -> Cli {
    let command = Cli::command()
        .mut_args(|arg| arg.hide(true))
        .after_help(AFTER);
    let matches = command.get_matches();
    Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

/// Runs the command.
pub fn run(cli: Cli) -> ExitCode {
    let result = match cli.command.unwrap_or(Command::Serve(Box::new(cli.serve))) {
        Command::Serve(args) => serve::run(*args),
        Command::Track(args) => track::run(args),
        Command::Eval(args) => evaluate::run(args),
        Command::Sample(args) => sample::run(args),
        Command::Health(args) => health::run(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bagtrack: {error}");
            ExitCode::FAILURE
        }
    }
}
