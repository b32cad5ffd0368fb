//! `bagtrack sample`.

use super::{output, progress};
use bagtrack::sample::{Clip, Format, Settings};
use std::path::PathBuf;

/// Flags of `sample`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder to write: img/0001.jpg and so on, and groundtruth_rect.txt (OTB layout, 1-based pixels).
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of frames.
    #[arg(long, default_value_t = Settings::default().frames)]
    frames: u32,
    /// Width of a frame in pixels.
    #[arg(long, default_value_t = Settings::default().width)]
    width: u32,
    /// Height of a frame in pixels.
    #[arg(long, default_value_t = Settings::default().height)]
    height: u32,
    /// Chooses the path, the textures and the noise: the same seed draws the same clip.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// How frames are stored.
    #[arg(long, value_enum, default_value_t = FormatFlag::Jpeg)]
    format: FormatFlag,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum FormatFlag {
    Jpeg,
    Png,
}

/// Runs `sample`.
pub fn run(args: Args) -> Result<(), Box<dyn std::error::Error>> {
    let format = match args.format {
        FormatFlag::Jpeg => Format::Jpeg,
        FormatFlag::Png => Format::Png,
    };
    let clip = Clip::new(Settings {
        frames: args.frames,
        width: args.width,
        height: args.height,
        seed: args.seed,
    })?;
    output::new_folder(&args.out)?;
    let bar = progress::bar(u64::from(args.frames), "drawing");
    clip.write(&args.out, format, || bar.inc(1))?;
    bar.finish_and_clear();
    let first = clip.target(0);
    println!(
        "{} frames in {}; the target starts at --box {:.1},{:.1},{:.1},{:.1}",
        args.frames,
        args.out.display(),
        first.x,
        first.y,
        first.width,
        first.height
    );
    Ok(())
}
