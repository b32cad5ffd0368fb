//! Runs the programs of the workspace, in temporary folders.
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A temporary folder, deleted when the value is dropped.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("the system has a place for temporary folders")
}

/// The path of a program of this workspace, which cargo builds beside the test that asks for it.
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a running program has a path");
    // Tests are built in `deps`, examples in `examples`; programs in the folder above.
    let folder = test.parent().and_then(Path::parent);
    let folder = folder.expect("cargo puts tests into a folder of its own");
    folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Runs a program of this workspace.
pub fn run(name: &str, args: &[&str]) -> Output {
    let output = Command::new(program(name)).args(args).output();
    output.unwrap_or_else(|error| panic!("{name}, which cargo builds: {error}"))
}

/// Standard output of a run, which must succeed with empty standard error.
pub fn success(output: Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert_eq!(
        errors, "",
        "it complains, or draws a progress bar for nobody"
    );
    String::from_utf8(output.stdout).expect("the output is text")
}

/// The one line that `name`, which must fail, prints on standard error.
pub fn failure(name: &str, output: Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let errors = String::from_utf8(output.stderr).expect("the message is text");
    assert!(errors.starts_with(&format!("{name}: ")), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
    errors
}

/// A folder, and the sample clip in it.
pub fn sample_clip() -> (TempDir, PathBuf) {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    (parent, dir)
}

pub fn bagtrack(args: &[&str]) -> Output {
    run("bagtrack", args)
}

/// Standard output of `bagtrack`, which must succeed.
pub fn succeeds(args: &[&str]) -> String {
    success(bagtrack(args))
}

/// The one line that `bagtrack`, which must fail, prints on standard error.
pub fn fails(args: &[&str]) -> String {
    failure("bagtrack", bagtrack(args))
}

/// The arguments of `bagtrack track` for these frames, and flags with spaces between them.
pub fn track<'a>(frames: &'a Path, flags: &'a str) -> Vec<&'a str> {
    let begin = ["track", text(frames)];
    begin.into_iter().chain(flags.split_whitespace()).collect()
}

/// A small sample clip under `parent`: 12 frames unless `extra` says otherwise.
pub fn clip(parent: &Path, name: &str, extra: &[&str]) -> PathBuf {
    let dir = parent.join(name);
    let out = text(&dir).to_owned();
    let mut args = vec!["sample", "--out", &out];
    args.extend(extra);
    if !extra.contains(&"--frames") {
        args.extend(["--frames", "12"]);
    }
    succeeds(&args);
    dir
}

pub fn text(path: &Path) -> &str {
    path.to_str().expect("temporary folders have plain names")
}

/// The boxes of a file in the OTB layout, unchanged: x, y, width, height, in pixels from 1.
pub fn boxes(lines: &str) -> Vec<[f64; 4]> {
    lines.lines().map(numbers).collect()
}

fn numbers(line: &str) -> [f64; 4] {
    let numbers: Vec<f64> = line
        .split(',')
        .map(|number| number.parse().expect("a number"))
        .collect();
    numbers.try_into().expect("four numbers")
}

/// A line of `track --format csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub frame: u64,
    pub time: Option<f64>,
    pub target: usize,
    pub area: [f64; 4],
    pub score: f64,
    pub status: String,
}

/// The lines of `track --format csv`.
pub fn rows(csv: &str) -> Vec<Row> {
    let mut lines = csv.lines();
    let header = "frame,time,target,x,y,width,height,score,status";
    assert_eq!(lines.next(), Some(header));
    lines.map(row).collect()
}

fn row(line: &str) -> Row {
    let fields: Vec<&str> = line.split(',').collect();
    assert_eq!(fields.len(), 9, "{line}");
    let number = |field: &str| field.parse().expect("a number");
    Row {
        frame: fields[0].parse().expect("a whole number"),
        time: (!fields[1].is_empty()).then(|| number(fields[1])),
        target: fields[2].parse().expect("a whole number"),
        area: numbers(&fields[3..7].join(",")),
        score: number(fields[7]),
        status: fields[8].to_owned(),
    }
}

/// A video of a clip's frames, at 30 frames a second, that plays them `times` times.
pub fn video_of(clip: &Path, video: &Path, times: u32) {
    let frames = clip.join("img/%04d.jpg");
    let again = (times - 1).to_string();
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-framerate", "30", "-stream_loop", &again]);
    command.args(["-i", text(&frames), "-b:v", "4M", text(video)]);
    assert!(command.status().expect("ffmpeg starts").success());
}

/// The output of ffprobe for a video, with the options `asked`.
pub fn probe(video: &Path, asked: &str) -> String {
    let mut command = Command::new("ffprobe");
    command.args(["-v", "error", "-of", "csv=p=0"]);
    let output = command.args(asked.split(' ')).arg(video).output();
    let told = String::from_utf8(output.expect("ffprobe starts").stdout).expect("text");
    told.trim().to_owned()
}

/// Width, height, rate and number of frames of a video, found by ffprobe, which decodes all of it.
pub fn about(video: &Path) -> String {
    let entries = "stream=width,height,avg_frame_rate,nb_read_frames";
    probe(video, &format!("-count_frames -show_entries {entries}"))
}
