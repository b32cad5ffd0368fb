//! `bagtrack eval`.

/// Flags of `eval`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `eval`.
pub fn run(_args: Args) -> Result<(), Box<dyn std::error::Error>> {
    todo!()
}
