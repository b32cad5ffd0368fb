//! `bagtrack track` on a video, and videos that it draws. They need ffmpeg, and say so where there is none.

use crate::command::{clip, fails, folder, succeeds, text};
use std::fs;
use std::path::Path;
use std::process::Command;

fn has_ffmpeg() -> bool {
    let found = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !found {
        eprintln!("left out: there is no ffmpeg");
    }
    found
}

/// A video of a clip's frames, at 30 frames a second.
fn video_of(clip: &Path, video: &Path) {
    let frames = clip.join("img/%04d.jpg");
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-framerate", "30", "-i", text(&frames)]);
    let made = command.args(["-b:v", "4M", text(video)]).status();
    assert!(made.expect("ffmpeg starts").success());
}

fn boxes(output: &str) -> Vec<Vec<f64>> {
    let numbers = |line: &str| {
        line.split(',')
            .map(|n| n.parse().expect("a number"))
            .collect()
    };
    output.lines().map(numbers).collect()
}

/// What ffprobe says of a video's frames: their size and rate, and how many there are.
fn about(video: &Path) -> String {
    let mut command = Command::new("ffprobe");
    command.args([
        "-v",
        "error",
        "-count_frames",
        "-of",
        "csv=p=0",
        "-show_entries",
    ]);
    command.arg("stream=width,height,avg_frame_rate,nb_read_frames");
    let output = command.arg(video).output().expect("ffprobe starts");
    String::from_utf8(output.stdout)
        .expect("text")
        .trim()
        .to_owned()
}

#[test]
fn a_video_gets_the_boxes_of_its_frames_and_a_drawn_video_has_all_of_them() {
    if !has_ffmpeg() {
        return;
    }
    let parent = folder();
    let dir = clip(
        parent.path(),
        "clip",
        &["--width", "161", "--height", "121"],
    );
    let padded = parent.path().join("even");
    let dir_even = clip(
        parent.path(),
        "even_clip",
        &["--width", "160", "--height", "120"],
    );
    let video = padded.with_extension("mp4");
    video_of(&dir_even, &video);
    let truth = fs::read_to_string(dir_even.join("groundtruth_rect.txt")).expect("it is there");
    let first: Vec<f64> = boxes(truth.lines().next().expect("a line")).remove(0);
    let target = format!(
        "{},{},{},{}",
        first[0] - 1.0,
        first[1] - 1.0,
        first[2],
        first[3]
    );
    let drawn = parent.path().join("drawn.mp4");
    let flags = ["--box", &target, "--seed", "7"];
    let of_folder = succeeds(&[&["track", text(&dir_even)], &flags[..]].concat());
    let draw = ["--draw", text(&drawn)];
    let of_video = succeeds(&[&["track", text(&video)], &flags[..], &draw].concat());
    let (a, b) = (boxes(&of_folder), boxes(&of_video));
    assert_eq!((a.len(), b.len()), (12, 12));
    for (a, b) in a.iter().zip(&b) {
        // The same frames but for what the codec lost.
        assert!(
            (a[0] - b[0]).abs() < 3.0 && (a[1] - b[1]).abs() < 3.0,
            "{a:?} {b:?}"
        );
    }
    assert_eq!(about(&drawn), "160,120,30/1,12");
    let line = fails(&[&["track", text(&video)], &flags[..], &draw].concat());
    assert!(line.contains("drawn.mp4 is there"), "{line}");
    // Pictures of a video have numbers; odd sides are made even in a video.
    let pictures = parent.path().join("pictures");
    let draw = ["--draw", text(&pictures)];
    succeeds(&[&["track", text(&video)], &flags[..], &draw].concat());
    assert!(pictures.join("000011.jpg").is_file());
    let odd = parent.path().join("odd.mp4");
    succeeds(&["track", text(&dir), "--box", &target, "--draw", text(&odd)]);
    assert_eq!(about(&odd), "162,122,25/1,12");
}

#[test]
fn what_is_no_video_is_told_in_one_line() {
    if !has_ffmpeg() {
        return;
    }
    let parent = folder();
    let file = parent.path().join("text.mp4");
    fs::write(&file, "no video").expect("the folder is writable");
    let line = fails(&["track", text(&file), "--box", "1,2,30,40"]);
    assert!(
        line.contains("text.mp4") && line.contains("cannot be decoded"),
        "{line}"
    );
    let line = fails(&["track", text(&file)]);
    assert!(line.contains("--box x,y,width,height is needed"), "{line}");
}
