//! `bagtrack sample`.

use bagtrack_cli::{output, progress};
use bagtrack_sample::{Clip, Format, Scene, Settings};
use std::path::PathBuf;

/// Flags of `sample`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder to write: img/0001.jpg and so on, groundtruth_rect.txt (OTB layout, 1-based pixels, 0,0,0,0 while
    /// nothing of the target is seen), and visible.txt (1 or 0 a line: whether any of it is seen).
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What happens to the target.
    #[arg(long, value_enum, default_value_t = SceneFlag::Default)]
    scene: SceneFlag,
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

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum SceneFlag {
    /// It turns, grows, dims and is half covered for a while; it is always in sight.
    Default,
    /// It passes behind a post: out of sight for 20 frames, it comes out on the other side.
    Covered,
    /// It leaves the frame, and comes back at the same side after 25 frames, higher or lower.
    Leaves,
}

/// Runs `sample`.
pub fn run(args: Args) -> Result<(), Box<dyn std::error::Error>> {
    let format = match args.format {
        FormatFlag::Jpeg => Format::Jpeg,
        FormatFlag::Png => Format::Png,
    };
    let scene = match args.scene {
        SceneFlag::Default => Scene::Default,
        SceneFlag::Covered => Scene::Covered,
        SceneFlag::Leaves => Scene::Leaves,
    };
    let clip = Clip::new(Settings {
        scene,
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
    let line = format!(
        "{} frames in {}; the target starts at --box {:.1},{:.1},{:.1},{:.1}\n",
        args.frames,
        args.out.display(),
        first.x,
        first.y,
        first.width,
        first.height
    );
    Ok(output::print(&line)?)
}
