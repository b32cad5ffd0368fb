//! `bagtrack track`.

/// Flags of `track`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `track`.
pub fn run(_args: Args) -> Result<(), Box<dyn std::error::Error>> {
    todo!()
}
