//! `bagtrack sample`.

use bagtrack_cli::output;
use bagtrack_sample::{Attributes, Clip, Format, Scene, Settings};
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
    #[command(flatten)]
    attributes: AttributeFlags,
    /// How frames are stored.
    #[arg(long, value_enum, default_value_t = FormatFlag::Jpeg)]
    format: FormatFlag,
}

/// What makes the clip hard, by the names of the attributes of OTB and UAV123.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What makes it hard")]
struct AttributeFlags {
    /// Factor on both sides of the target, 0.05 to 2.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    low_resolution: f64,
    /// Factor on the target's speed in the default scene, 0 to 20: 1 is about 4 pixels a frame at 320 x 240.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    fast_motion: f64,
    /// Share of the time between two frames for which the shutter is open, 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    motion_blur: f64,
    /// How far the camera shakes from frame to frame, in shorter sides of the frame, 0 to 0.25.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    camera_motion: f64,
    /// Factor on both sides of the target that is reached in the last frame, 0.1 to 10.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    scale_variation: f64,
    /// Factor on the target's width that is reached half way, 0.1 to 1, as if it turned out of the plane and back.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    out_of_plane_rotation: f64,
    /// Degrees a frame by which the target turns, -90 to 90; the true box is the upright one around it.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    in_plane_rotation: f64,
    /// Objects that look like the target and move behind it, 0 to 8.
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    similar_objects: u32,
}

impl From<AttributeFlags> for Attributes {
    fn from(flags: AttributeFlags) -> Self {
        Self {
            low_resolution: flags.low_resolution,
            fast_motion: flags.fast_motion,
            motion_blur: flags.motion_blur,
            camera_motion: flags.camera_motion,
            scale_variation: flags.scale_variation,
            out_of_plane_rotation: flags.out_of_plane_rotation,
            in_plane_rotation: flags.in_plane_rotation,
            similar_objects: flags.similar_objects,
        }
    }
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
        attributes: args.attributes.into(),
    })?;
    output::new_folder(&args.out)?;
    let bar = output::bar(u64::from(args.frames), "drawing");
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
