//! `bagtrack track`: the tracker on a video or a folder of frames.
//!
//! In: frames, and a box for each target in the first of them. Out: a row for each target in each frame, and the frames
//! with the boxes drawn on them.
//!
//! What can go wrong: a path cannot be read or written, which is an error before the first row. A frame that cannot be
//! read, or a signal, ends the command; the rows and the drawn frames before it are kept, and the drawn video is
//! finished.

mod drawn;
mod follow;
mod frames;
mod interrupt;
mod reversed;
mod rows;
mod start;
mod targets;
mod video_file;
mod video_info;

use bagtrack_api::requests::Name;
use bagtrack_cli::{BOXES, ModelFlag, ParamFlags, output, read_boxes};
use bagtrack_formats::{Columns, FileFormat, Format, Unfit};
use bagtrack_sessions::{MAX_TARGETS, Selection};
use bagtrack_tracker::Rect;
use drawn::Destination;
use follow::Job;
use frames::{Direction, Frames};
use interrupt::Interrupt;
use rows::Rows;
use start::Start;
use std::error::Error;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Flags of `track`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A folder of JPEG, PNG or WebP frames, taken in the order of their names; or one with them in img/; or a video
    /// file, for which ffmpeg must be installed.
    #[arg(value_name = "VIDEO|DIR")]
    path: PathBuf,
    /// The target in the first frame: x,y,width,height in pixels, 0-based from the top-left corner, as the service
    /// takes it. Given several times, it is a target each, up to 16. Without it, the box of the first frame in
    /// groundtruth_rect.txt in DIR is taken (1-based there).
    #[arg(long = "box", value_name = "X,Y,W,H", value_parser = rect, allow_hyphen_values = true)]
    boxes: Vec<Rect>,
    /// What a target is called, where the format says it: once for each box, in their order. Without it they are Object
    /// 1, Object 2, …
    #[arg(long = "name", value_name = "NAME", value_parser = target_name)]
    names: Vec<String>,
    /// The first frame: its number, counted from 0, or its time in a video, like 12.5s, 1:30 or 0:01:30. The boxes hold
    /// there, and the frames before it are passed over.
    #[arg(long, value_name = "FRAME|TIME", value_parser = start::parse)]
    start: Option<Start>,
    /// Tracks at most so many frames after the first one.
    #[arg(long, value_name = "N", visible_alias = "count")]
    frames: Option<u64>,
    /// Tracks from the first frame back to the beginning of the video or folder.
    #[arg(long)]
    backwards: bool,
    /// Ends when all targets are lost. A target's last row is the one in which it is lost.
    #[arg(long)]
    until_lost: bool,
    /// Writes only key frames: between two of them straight lines give every edge of every box to within a pixel. Where
    /// a target is lost, the run of lost frames has a key frame at each of its ends.
    #[arg(long)]
    keyframes: bool,
    #[command(flatten)]
    params: ParamFlags,
    #[command(flatten)]
    model: ModelFlag,
    /// Seed of all random draws: the same seed gives the same boxes.
    #[arg(long)]
    seed: Option<u64>,
    /// How boxes are written [default: text; csv, json or cvat where the output ends with .csv, .jsonl or .xml]. Frames
    /// and targets count from 0 but for otb, mot, and what COCO and Label Studio count.
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Writes the boxes to a new file, not to standard output; with --format yolo to a new folder.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also writes every frame with its boxes: green tracking, orange uncertain, red lost. OUT is a new video (.mp4,
    /// .m4v, .mov, .mkv, .webm, .avi, .gif), for which ffmpeg must be installed; or a new folder of JPEG files, if it
    /// has no ending, or a slash at its end. The frames of a video keep their times; in an .avi they last equally long,
    /// at the rate that the source has on average, and a .gif has at most 50 of them a second. An odd side gets a black
    /// row or column more: encoders want even ones.
    #[arg(long, value_name = "OUT")]
    draw: Option<PathBuf>,
}

/// Runs `track`. The exit status is that of a signal, if one ended it.
pub fn run(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    let interrupt = Interrupt::listen()?;
    let mut params = args.params.params()?;
    params.seed = args.seed.unwrap_or(params.seed);
    let format = check(&args)?;
    let expert = args.model.load()?;
    let destination = args.draw.as_deref().map(Destination::of).transpose()?;
    let direction = match args.backwards {
        true => Direction::Backwards,
        false => Direction::Forwards,
    };
    let frames = Frames::open(&args.path, args.start.unwrap_or(Start::Frame(0)), direction)?;
    let boxes = match args.boxes.is_empty() {
        true => vec![annotated(&args.path, frames.first())?],
        false => args.boxes,
    };
    let names = names_of(&args.names, boxes.len())?;
    let columns = Columns {
        time: frames.have_times(),
        target: boxes.len() > 1,
    };
    let rows = Rows::open(args.output.as_deref(), format, columns)?;
    let bar = match rows.are_on_terminal() {
        // The rows on the terminal show the progress, and a bar would be written among them.
        true => indicatif::ProgressBar::hidden(),
        false => output::bar_or_count(left(&frames, args.frames), "frames"),
    };
    let job = Job {
        selection: Selection::new(boxes.len(), args.until_lost, args.keyframes),
        count: args.frames,
        frames,
        boxes,
        params,
        expert,
        destination,
        rows,
        name: name_of(&args.path),
        names,
        bar: bar.clone(),
    };
    let followed = job.run(&interrupt);
    bar.finish_and_clear();
    let count = followed?;
    if interrupt.came() {
        eprintln!("bagtrack: stopped by a signal after {count} frames");
    }
    Ok(interrupt.exit_code())
}

/// How many frames will be tracked, the first included, where that is known.
fn left(frames: &Frames, most: Option<u64>) -> Option<u64> {
    let wanted = most.map(|most| most.saturating_add(1));
    frames.left().into_iter().chain(wanted).min()
}

/// The format of the boxes. Checks all flags that can be checked before a file is opened.
fn check(args: &Args) -> Result<Format, String> {
    let count = args.boxes.len();
    if count > MAX_TARGETS {
        return Err(format!(
            "--box is given {count} times; {MAX_TARGETS} targets are followed at most"
        ));
    }
    let format = match args.format {
        Some(format) => format,
        None => format_of(args.output.as_deref())?,
    };
    let fits = format.check(count, args.keyframes);
    fits.map_err(|unfit| match unfit {
        Unfit::Targets => format!("--format {unfit}"),
        Unfit::KeyFrames => format!("--keyframes: {unfit}"),
    })?;
    if args.backwards && args.start.is_none() {
        let text = "--backwards goes from --start to the first frame: give --start, a frame's number or time";
        return Err(text.to_owned());
    }
    Ok(format)
}

/// The format that the ending of the output's name tells.
fn format_of(output: Option<&Path>) -> Result<Format, String> {
    let ending = output.and_then(Path::extension).and_then(OsStr::to_str);
    Ok(Format::File(match ending {
        Some("csv") => FileFormat::Csv,
        Some("jsonl") => FileFormat::Json,
        Some("xml") => FileFormat::Cvat,
        Some("json") => {
            let text = "several formats are .json: give --format json, coco or label-studio";
            return Err(text.to_owned());
        }
        _ => FileFormat::Text,
    }))
}

/// The name of a file or folder itself, without the path to it and links.
fn name_of(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let name = whole.file_name().unwrap_or(whole.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Reads the name of a target, by the rules of the service.
fn target_name(text: &str) -> Result<String, String> {
    Name::try_from(text.to_owned()).map(|name| name.0)
}

/// The names of `count` targets.
fn names_of(given: &[String], count: usize) -> Result<Vec<String>, String> {
    if given.len() > count {
        return Err(format!(
            "--name is given {} times, for {count} box{}",
            given.len(),
            if count == 1 { "" } else { "es" }
        ));
    }
    let made = (given.len()..count).map(|target| format!("Object {}", target + 1));
    Ok(given.iter().cloned().chain(made).collect())
}

/// The box of frame `index` in the annotations of `dir`.
fn annotated(dir: &Path, index: u64) -> Result<Rect, String> {
    let needed = |why: String| {
        format!(
            "{}: --box x,y,width,height is needed ({why})",
            dir.display()
        )
    };
    let name = BOXES;
    if !dir.join(name).is_file() {
        return Err(needed(format!(
            "there is no {name} to take the first box from"
        )));
    }
    let boxes = read_boxes(dir).map_err(|error| error.to_string())?;
    let found = usize::try_from(index)
        .ok()
        .and_then(|index| boxes.get(index).copied().flatten());
    found.ok_or_else(|| needed(format!("frame {index} is not annotated in {name}")))
}

fn rect(text: &str) -> Result<Rect, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) => Ok(Rect::new(x, y, width, height)),
        _ => Err("it must be four numbers: x,y,width,height".to_owned()),
    }
}
