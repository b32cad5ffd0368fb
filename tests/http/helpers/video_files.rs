//! Video files that ffmpeg makes.

use crate::pictures;
use image::ImageFormat;
use serde_json::Value;
use std::io::Write;
use std::process::{Command, Stdio};

pub const FRAMES: u32 = 12;

/// The drawn frames 1 to [`FRAMES`] as a video of this kind.
pub fn video(extension: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("video").with_extension(extension);
    let pictures_in = "-v error -f image2pipe -framerate 25 -c:v png -i pipe:0";
    let mut command = Command::new("ffmpeg");
    command.args(pictures_in.split(' '));
    if extension != "gif" {
        command.args(["-pix_fmt", "yuv420p", "-b:v", "2M"]);
    }
    let mut child = command.arg(&file).stdin(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    for t in 1..=FRAMES {
        input.write_all(&pictures::png(t)).unwrap();
    }
    drop(input);
    assert!(child.wait().unwrap().success(), "{extension}");
    std::fs::read(file).unwrap()
}

/// The file that ffmpeg makes with these arguments.
pub fn made(name: &str, arguments: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-f", "lavfi", "-i"]);
    command.args(arguments.split(' ')).arg(&file);
    assert!(command.status().unwrap().success(), "{arguments}");
    std::fs::read(file).unwrap()
}

/// A video with this many pictures of ffmpeg's test pattern, of 320 x 240 pixels, made with further arguments.
pub fn pattern(extension: &str, pictures: u32, arguments: &str) -> Vec<u8> {
    let source = format!("testsrc2=size=320x240:rate=30 {arguments}-frames:v {pictures} -b:v 2M");
    made(&format!("pattern.{extension}"), &source)
}

pub fn motion_jpeg() -> Vec<u8> {
    let frames = (1..=FRAMES).map(|t| pictures::encode(pictures::scene(t), ImageFormat::Jpeg));
    frames.flatten().collect()
}

/// Checks that the box of an answer is on the target of drawn frame `t`.
#[track_caller]
pub fn expect_on_target(answer: &Value, t: u32) {
    let x = answer["box"]["x"].as_f64().unwrap();
    assert!((x - f64::from(20 + 2 * t)).abs() < 3.0, "{t}: {answer}");
}

/// Bytes that begin like an MP4 file, and contain nothing else.
pub fn empty_mp4() -> Vec<u8> {
    [b"\0\0\0\x18ftypmp42".to_vec(), vec![0; 400]].concat()
}
