//! `bagtrack health`.

/// Flags of `health`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `health`.
pub fn run(_args: Args) -> Result<(), Box<dyn std::error::Error>> {
    todo!()
}
