//! `bagtrack track`.

use super::track_frames::Frames;
use super::track_writer::Writer;
use bagtrack_cli::progress;
use bagtrack_cli::{BOXES, ParamFlags, read_boxes};
use bagtrack_ingest::Limits;
use bagtrack_tracker::{Estimate, Params, Rect, Tracker};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Flags of `track`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A folder of JPEG, PNG or WebP frames, taken in the order of their names; or one with them in img/; or a video file,
    /// for which ffmpeg must be installed.
    #[arg(value_name = "VIDEO|DIR")]
    path: PathBuf,
    /// The target in the first frame: x,y,width,height in pixels, 0-based from the top-left corner, as the service
    /// takes it. Without it, the first box of groundtruth_rect.txt in DIR is taken (1-based there).
    #[arg(long = "box", value_name = "X,Y,W,H", value_parser = rect, allow_hyphen_values = true)]
    target: Option<Rect>,
    #[command(flatten)]
    params: ParamFlags,
    /// Seed of all random draws: the same seed gives the same boxes.
    #[arg(long)]
    seed: Option<u64>,
    /// `otb`: x,y,width,height a line (0-based pixels, unlike files of the benchmark). `json`: an object a line.
    #[arg(long, value_enum, default_value_t = Format::Otb)]
    format: Format,
    /// Also writes every frame with its box: green tracking, orange uncertain, red lost. OUT is a new folder, or a new
    /// video file (.mp4, .webm, .mkv, .mov), for which ffmpeg must be installed.
    #[arg(long, value_name = "OUT")]
    draw: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Format {
    Otb,
    Json,
}

/// A line of JSON output.
#[derive(serde::Serialize)]
struct Line<'a> {
    frame: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
    #[serde(rename = "box")]
    target: Rect,
    score: f32,
    status: bagtrack_tracker::Status,
}

/// Runs `track`.
pub fn run(args: Args) -> Result<(), Box<dyn std::error::Error>> {
    let mut params = args.params.params()?;
    if let Some(seed) = args.seed {
        params.seed = seed;
    }
    let mut frames = Frames::open(&args.path)?;
    let target = match args.target {
        Some(target) => target,
        None => first_annotated(&args.path)?,
    };
    let writer = args
        .draw
        .as_deref()
        .map(|out| Writer::open(out, frames.rate()));
    let mut writer = writer.transpose()?;
    let bar = progress::bar_or_count(frames.count(), "frames");
    let mut tracker = None;
    while let Some(frame) = frames.next()? {
        let named = |error: &dyn std::fmt::Display| format!("{}: {error}", frame.shown);
        let estimate = advance(&mut tracker, &frame.bytes, target, &params);
        let estimate = estimate.map_err(|error| named(&error))?;
        if let Some(writer) = &mut writer {
            let written = writer.add(&frame, &estimate);
            written.map_err(|error| named(&error))?;
        }
        let written = bar.suspend(|| write_line(args.format, frame.file.as_deref(), &estimate));
        match written {
            // The reader has seen enough: `bagtrack track … | head`.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => break,
            other => other?,
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    match writer {
        Some(writer) => writer.finish(),
        None => Ok(()),
    }
}

/// Starts the tracker on the first frame, steps it on every other.
fn advance(
    tracker: &mut Option<Tracker>,
    bytes: &[u8],
    target: Rect,
    params: &Params,
) -> Result<Estimate, Box<dyn std::error::Error>> {
    let limits = Limits::default();
    match tracker {
        Some(tracker) => {
            let format = tracker.frame_format();
            let frame = bagtrack_ingest::decode_to(bytes, &limits, &|_| format)?;
            Ok(tracker.step(&frame)?)
        }
        None => {
            let format = |source| params.frame_format(source, &target);
            let frame = bagtrack_ingest::decode_to(bytes, &limits, &format)?;
            let first = Tracker::new(&frame, target, params.clone())?;
            Ok(tracker.insert(first).estimate())
        }
    }
}

fn first_annotated(dir: &Path) -> Result<Rect, String> {
    if !dir.join(BOXES).is_file() {
        return Err(format!(
            "{}: --box x,y,width,height is needed (there is no {} to take the first box from)",
            dir.display(),
            BOXES
        ));
    }
    let boxes = read_boxes(dir).map_err(|error| error.to_string())?;
    let first = boxes.first().copied().flatten();
    first.ok_or_else(|| {
        format!(
            "{}: --box x,y,width,height is needed (the first frame is not annotated in {})",
            dir.display(),
            BOXES
        )
    })
}

fn write_line(format: Format, file: Option<&str>, estimate: &Estimate) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let Rect {
        x,
        y,
        width,
        height,
    } = estimate.target;
    match format {
        Format::Otb => writeln!(out, "{x:.3},{y:.3},{width:.3},{height:.3}"),
        Format::Json => {
            let line = Line {
                frame: estimate.frame,
                file,
                target: estimate.target,
                score: estimate.score,
                status: estimate.status,
            };
            writeln!(out, "{}", serde_json::to_string(&line)?)
        }
    }
}

fn rect(text: &str) -> Result<Rect, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) => Ok(Rect {
            x,
            y,
            width,
            height,
        }),
        _ => Err("it must be four numbers: x,y,width,height".to_owned()),
    }
}
