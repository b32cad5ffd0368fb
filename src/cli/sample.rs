//! `bagtrack sample`.

/// Flags of `sample`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `sample`.
pub fn run(_args: Args) -> Result<(), Box<dyn std::error::Error>> {
    todo!()
}
