//! `bagtrack serve`.

/// Flags of `serve`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `serve`.
pub fn run(_args: Args) -> Result<(), Box<dyn std::error::Error>> {
    todo!()
}
