//! Videos and pictures with painted boxes (`bagtrack track --draw`). Most need ffmpeg.

use crate::command::{about, bagtrack, folder, probe, rows, succeeds, text};
use crate::track_video::{TEST_PICTURES, ffmpeg_in, shown_at, small_clip};
use std::fs;
use std::process::Command;

#[test]
#[ignore = "needs ffmpeg"]
fn each_ending_that_is_offered_becomes_a_video_of_this_kind() {
    let parent = folder();
    // Odd sides are made even if the encoder needs that.
    let (dir, target) = small_clip(parent.path(), "odd", ["161", "121"]);
    for (ending, kind, size) in [
        ("mp4", "mp4", "162,122"),
        ("m4v", "mp4", "162,122"),
        ("mov", "mov", "162,122"),
        ("mkv", "matroska", "162,122"),
        ("webm", "webm", "162,122"),
        ("avi", "avi", "162,122"),
        ("gif", "gif", "161,121"),
    ] {
        let video = parent.path().join(format!("drawn.{ending}"));
        let printed = succeeds(&["track", text(&dir), &target, "--draw", text(&video)]);
        assert_eq!(printed.lines().count(), 13, "{ending}: {printed}");
        assert_eq!(about(&video), format!("{size},25/1,12"), "{ending}");
        let format = probe(&video, "-show_entries format=format_name");
        assert!(format.contains(kind), "{ending}: {format}");
    }
}

#[test]
fn what_cannot_be_drawn_is_told_before_the_first_row_and_leaves_nothing() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let there = parent.path().join("there.mp4");
    fs::write(&there, "mine").expect("the folder is writable");
    for (name, said) in [
        (
            "out.xyz",
            "it can write a video (.mp4, .m4v, .mov, .mkv, .webm, .avi, .gif), or a folder",
        ),
        ("out.jpg", "or a folder of JPEG files, as"),
        ("nowhere/out.mp4", "there is no folder"),
        ("there.mp4", "it is there"),
    ] {
        let out = parent.path().join(name);
        let output = bagtrack(&["track", text(&dir), &target, "--draw", text(&out)]);
        let errors = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(1), "{name}");
        assert!(output.stdout.is_empty(), "{name}: rows before {errors}");
        assert!(errors.contains(said), "{name}: {errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    assert_eq!(fs::read(&there).expect("it is there"), b"mine");
    let left = fs::read_dir(parent.path()).expect("it is there").count();
    assert_eq!(left, 2, "the clip and the file that was there");
}

#[test]
fn a_name_with_a_slash_at_its_end_is_a_folder_whatever_its_ending() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let out = parent.path().join("out.avi");
    let slash = format!("{}/", text(&out));
    succeeds(&["track", text(&dir), &target, "--draw", &slash]);
    assert_eq!(fs::read_dir(&out).expect("a folder").count(), 12);
}

#[cfg(unix)]
#[test]
#[ignore = "needs ffmpeg"]
fn an_encoder_that_this_ffmpeg_does_not_have_is_told_before_the_first_row() {
    use std::os::unix::fs::PermissionsExt;
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let programs = parent.path().join("programs");
    fs::create_dir(&programs).expect("the folder is writable");
    let program = programs.join("ffmpeg");
    // A script that calls the real ffmpeg with an encoder that it does not have.
    let path = std::env::var("PATH").expect("it is set");
    let encode = "-f mjpeg -i pipe:0 -c:v nothing";
    let script = format!(
        "#!/bin/sh\nPATH='{path}'\nfor last; do :; done\nexec ffmpeg -v error {encode} \"$last\"\n"
    );
    fs::write(&program, script).expect("the folder is writable");
    let executable = fs::Permissions::from_mode(0o755);
    fs::set_permissions(&program, executable).expect("it is ours");
    let out = parent.path().join("out.webm");
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
    command.args(["track", text(&dir), &target, "--draw", text(&out)]);
    let output = command.env("PATH", &programs).output().expect("it starts");
    let errors = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty(), "rows before {errors}");
    let told =
        errors.contains("out.webm: this ffmpeg cannot write it") && errors.contains("nothing");
    assert!(told, "{errors}");
    assert!(!out.exists());
}

#[test]
fn a_folder_has_no_frames_that_are_hidden_and_draws_each_of_the_others() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let frames = parent.path().join("frames");
    fs::create_dir(&frames).expect("the folder is writable");
    let first = dir.join("img/0001.jpg");
    let picture = image::open(&first).expect("it is a picture");
    fs::copy(&first, frames.join("a.jpg")).expect("it is there");
    picture.save(frames.join("a.png")).expect("it is writable");
    fs::write(frames.join("._a.jpg"), "of macOS").expect("it is writable");
    let drawn = format!("{}/", text(&parent.path().join("drawn")));
    let printed = succeeds(&[
        "track",
        text(&frames),
        &target,
        "--format",
        "csv",
        "--draw",
        &drawn,
    ]);
    assert_eq!(rows(&printed).len(), 2);
    let mut names: Vec<_> = fs::read_dir(&drawn).expect("it is there").collect();
    names.sort_by_key(|entry| entry.as_ref().expect("it is there").file_name());
    let names = names
        .into_iter()
        .map(|entry| entry.expect("it is there").file_name());
    assert_eq!(names.collect::<Vec<_>>(), ["a.jpg", "a.png.jpg"]);
}

/// DV, DVDs and many cameras have pixels that are not square; the drawn video must have the same aspect ratio.
#[test]
#[ignore = "needs ffmpeg"]
fn a_drawn_video_has_pixels_of_the_shape_of_the_source() {
    let parent = folder();
    let coded = "-frames:v 9 -vf setsar=16/11 -c:v libx264 wide.mp4";
    ffmpeg_in(parent.path(), &format!("{TEST_PICTURES} {coded}"));
    for name in ["drawn.mp4", "drawn.mkv"] {
        let (source, drawn) = (parent.path().join("wide.mp4"), parent.path().join(name));
        let flags = ["--box=50,40,30,30", "--draw", text(&drawn)];
        succeeds(&[&["track", text(&source)], &flags[..]].concat());
        let told = probe(&drawn, "-show_entries stream=sample_aspect_ratio");
        assert_eq!(told, "16:11", "{name}");
    }
}

/// Players show a picture of a GIF for 0.1 s if its time is below 0.02 s.
#[test]
#[ignore = "needs ffmpeg"]
fn a_gif_of_a_fast_video_lasts_as_long_as_the_video() {
    let parent = folder();
    let source = TEST_PICTURES.replace("rate=30", "rate=60");
    ffmpeg_in(parent.path(), &format!("{source} -frames:v 30 fast.mp4"));
    let (video, drawn) = (
        parent.path().join("fast.mp4"),
        parent.path().join("fast.gif"),
    );
    let flags = ["--box=50,40,30,30", "--draw", text(&drawn)];
    succeeds(&[&["track", text(&video)], &flags[..]].concat());
    let times = shown_at(&drawn);
    assert_eq!(times.len(), 15, "{times:?}");
    assert!((times[14] - 28.0 / 60.0).abs() < 0.02, "{times:?}");
}
