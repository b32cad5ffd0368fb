//! Ctrl-C while `bagtrack track` draws a video: the video so far must play, and the rows must be kept.
#![cfg(unix)]

use crate::command::{about, clip, folder, rows, text, video_of};
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};

/// Frames of the video; tracking them all would take many seconds.
const FRAMES: usize = 12 * 100;

/// `bagtrack track` as a terminal starts it: with a process group of its own, whose members all get Ctrl-C.
fn start(args: &[&str]) -> (Child, BufReader<ChildStdout>) {
    let program = env!("CARGO_BIN_EXE_bagtrack");
    let mut command = match cfg!(target_os = "linux") {
        // Restores SIGHUP: under nohup, programs ignore it.
        true => Command::new("env"),
        false => Command::new(program),
    };
    if cfg!(target_os = "linux") {
        command.args(["--default-signal=HUP", program]);
    }
    command.args(["track", "--format", "csv", "--box=21,50,23,28"]);
    command.args(args).process_group(0);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("cargo has built the binary");
    let out = child.stdout.take().expect("it is a pipe");
    (child, BufReader::new(out))
}

fn id(child: &Child) -> Pid {
    Pid::from_raw(i32::try_from(child.id()).expect("a small number")).expect("it runs")
}

/// Reads some rows, sends the signal to the process group, and reads the rest. Returns standard output and standard
/// error, and the exit status.
fn stop_by(signal: Signal, args: &[&str]) -> (String, String, ExitStatus) {
    let (mut child, mut out) = start(args);
    let mut text = String::new();
    for _ in 0..30 {
        out.read_line(&mut text).expect("text");
    }
    kill_process_group(id(&child), signal).expect("it runs");
    out.read_to_string(&mut text).expect("text");
    let mut said = String::new();
    let mut stderr = child.stderr.take().expect("it is a pipe");
    stderr.read_to_string(&mut said).expect("text");
    (text, said, child.wait().expect("it is a child"))
}

/// A video that takes far longer to track than a signal takes to arrive.
fn long_video(parent: &Path) -> std::path::PathBuf {
    let dir = clip(parent, "clip", &["--width", "160", "--height", "120"]);
    // A video without an index: ffmpeg must read it from the beginning.
    let video = parent.join("long.avi");
    video_of(&dir, &video, 100);
    video
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_signal_ends_the_drawn_video_properly_and_keeps_the_rows() {
    let parent = folder();
    let video = long_video(parent.path());
    for (signal, status, name) in [
        (Signal::INT, 130, "stopped.mp4"),
        (Signal::TERM, 143, "stopped.avi"),
        // SIGHUP, as when the terminal is closed.
        (Signal::HUP, 129, "stopped.mkv"),
    ] {
        let drawn = parent.path().join(name);
        let (csv, said, ended) = stop_by(signal, &[text(&video), "--draw", text(&drawn)]);
        assert_eq!(ended.code(), Some(status), "{said}");
        let count = rows(&csv).len();
        assert!((29..FRAMES).contains(&count), "{count} rows");
        assert_eq!(
            said,
            format!("bagtrack: stopped by a signal after {count} frames\n")
        );
        assert_eq!(about(&drawn), format!("160,120,30/1,{count}"), "{name}");
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_signal_keeps_the_rows_of_a_file_and_of_a_folder() {
    let parent = folder();
    let video = long_video(parent.path());
    let drawn = parent.path().join("drawn");
    let (csv, said, ended) = stop_by(Signal::INT, &[text(&video), "--draw", text(&drawn)]);
    assert_eq!(ended.code(), Some(130), "{said}");
    let pictures = fs::read_dir(&drawn).expect("it was made").count();
    assert_eq!(pictures, rows(&csv).len());
}

/// Skipping the frames before `--start` can take long, and must be interruptible, too.
#[test]
#[ignore = "needs ffmpeg"]
fn a_signal_before_the_first_row_ends_it_too() {
    let parent = folder();
    let video = long_video(parent.path());
    let file = parent.path().join("boxes.csv");
    let start_at = (FRAMES - 1).to_string();
    let (mut child, _out) = start(&[text(&video), "--start", &start_at, "-o", text(&file)]);
    // Once the output file exists, the command is about to read the frames.
    while !file.exists() {
        assert!(child.try_wait().expect("it is a child").is_none());
        std::thread::yield_now();
    }
    kill_process_group(id(&child), Signal::INT).expect("it runs");
    assert_eq!(child.wait().expect("it is a child").code(), Some(130));
    assert!(!file.exists(), "a file without a row");
}

/// The rows go to a pipe without a reader, which blocks the command, so that the first signal does not end it.
#[test]
fn a_second_signal_ends_it_at_once() {
    let parent = folder();
    let dir = clip(
        parent.path(),
        "clip",
        &["--width", "160", "--height", "120"],
    );
    let pipe = parent.path().join("pipe");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo starts").success());
    let drawn = parent.path().join("drawn");
    let (mut child, _out) = start(&[text(&dir), "-o", text(&pipe), "--draw", text(&drawn)]);
    // The command installs its signal handlers before it makes the folder.
    while !drawn.exists() {
        assert!(child.try_wait().expect("it is a child").is_none());
        std::thread::yield_now();
    }
    kill_process(id(&child), Signal::INT).expect("it runs");
    kill_process(id(&child), Signal::TERM).expect("it runs");
    let ended = child.wait().expect("it is a child");
    // If both signals are pending, either may be delivered last.
    let signals = [Signal::INT, Signal::TERM].map(|signal| Some(signal.as_raw()));
    assert!(signals.contains(&ended.signal()), "{ended}");
}
