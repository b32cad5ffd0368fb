//! Cut or damaged videos: which of their pictures count as frames. All need ffmpeg.

use crate::command::{fails, folder, rows, succeeds, text};
use crate::track_video::{TEST_PICTURES, ffmpeg_in, times_and_end};
use std::fs;
use std::path::Path;

/// Whether these are consecutive times at 30 frames a second.
fn are_even(times: &[f64]) -> bool {
    let mut pairs = times.windows(2);
    pairs.all(|pair| (pair[1] - pair[0] - 1.0 / 30.0).abs() < 2e-3)
}

/// After a cut in an open group of pictures, the first packets depend on pictures before the cut. They cannot be
/// decoded, and must not count as frames.
#[test]
#[ignore = "needs ffmpeg"]
fn pictures_that_cannot_be_made_after_a_cut_have_no_numbers() {
    let parent = folder();
    let cut = parent.path().join("cut.mkv");
    let source = "color=size=96x64:rate=30:duration=2,geq=lum='20+3*N+25*mod(floor(X/8)+floor(Y/8)\\,2)':cb=128:cr=128";
    let coded = "log-level=none:open-gop=1:keyint=15:min-keyint=15:bframes=4:b-adapt=0";
    let coded = format!("-c:v libx265 -x265-params {coded} whole.mkv");
    ffmpeg_in(parent.path(), &format!("-f lavfi -i {source} {coded}"));
    ffmpeg_in(parent.path(), "-ss 0.8 -i whole.mkv -c copy cut.mkv");
    let track = |start: usize| {
        let out = format!("{}/", text(&parent.path().join(start.to_string())));
        let start_at = start.to_string();
        let flags = ["--box=30,20,24,24", "--start", &start_at, "--format", "csv"];
        let printed = succeeds(&[&["track", text(&cut)], &flags[..], &["--draw", &out]].concat());
        let rows = rows(&printed).into_iter();
        let times: Vec<f64> = rows.map(|row| row.time.expect("it has a time")).collect();
        let first = image::open(Path::new(&out).join(format!("{start:06}.jpg")));
        (times, first.expect("it was drawn").into_luma8())
    };
    let (times, _) = track(0);
    assert!(times.len() > 30, "{times:?}");
    for (index, pair) in times.windows(2).enumerate() {
        assert!(
            (pair[1] - pair[0] - 1.0 / 30.0).abs() < 2e-3,
            "{index}: {times:?}"
        );
    }
    for start in [1, 12] {
        let (later, picture) = track(start);
        assert_eq!(later, times[start..]);
        let of_whole = parent.path().join(format!("0/{start:06}.jpg"));
        let of_whole = image::open(of_whole).expect("it was drawn").into_luma8();
        // A pixel of the background, away from the box: each frame is 3 gray levels lighter than the one before.
        let gray = |picture: &image::GrayImage| f64::from(picture.get_pixel(68, 60).0[0]);
        assert!((gray(&picture) - gray(&of_whole)).abs() < 1.7, "{start}");
    }
    let beyond = times.len().to_string();
    let line = fails(&["track", text(&cut), "--box=30,20,24,24", "--start", &beyond]);
    assert!(line.contains(&format!("it has {beyond} frames")), "{line}");
}

/// Packets of hidden pictures, which only serve to decode others, must not count as frames: all later times would be
/// wrong.
#[test]
#[ignore = "needs ffmpeg"]
fn pictures_of_vp8_that_are_not_shown_have_no_numbers() {
    let parent = folder();
    let coded = "-frames:v 90 -c:v libvpx -b:v 300k -auto-alt-ref 1 -lag-in-frames 25";
    for pass in [1, 2] {
        let arguments = format!("{TEST_PICTURES} {coded} -y -pass {pass} vp8.webm");
        ffmpeg_in(parent.path(), &arguments);
    }
    for start in [0, 60] {
        let video = parent.path().join("vp8.webm");
        let (times, end) = times_and_end(&video, &start.to_string());
        assert_eq!((times.len(), end.as_str()), (90 - start, ""));
        assert!(are_even(&times), "{times:?}");
        assert!((times[0] - start as f64 / 30.0).abs() < 2e-3, "{times:?}");
    }
}

/// Each of these must have rows for all pictures that can be decoded.
#[test]
#[ignore = "needs ffmpeg"]
fn what_is_no_damage_of_a_picture_ends_no_video() {
    let parent = folder();
    let make = |arguments: &str| ffmpeg_in(parent.path(), arguments);
    let video = |name: &str| parent.path().join(name);
    let coded = "-f lavfi -i sine -frames:v 30 -c:v libx264 -c:a aac -shortest whole.mp4";
    make(&format!("{TEST_PICTURES} {coded}"));
    // Damage in the sound does not matter.
    make("-i whole.mp4 -c copy -bsf:a noise=amount=5 noisy.mp4");
    let (times, end) = times_and_end(&video("noisy.mp4"), "0");
    assert_eq!((times.len(), end.as_str()), (30, ""));
    // The end is missing, and ffmpeg reports that at once, when it looks for the index.
    make("-i whole.mp4 -an -c:v libvpx-vp9 -cpu-used 8 whole.webm");
    let bytes = fs::read(video("whole.webm")).expect("it was made");
    fs::write(video("cut.webm"), &bytes[..bytes.len() * 8 / 10]).expect("it is writable");
    let (all, end) = times_and_end(&video("cut.webm"), "0");
    assert!((15..30).contains(&all.len()), "{all:?}");
    assert!(end.contains("File ended prematurely"), "{end}");
    let (later, end) = times_and_end(&video("cut.webm"), "5");
    assert_eq!(later, all[5..]);
    assert!(end.contains("File ended prematurely"), "{end}");
    // Two pictures have the same time.
    let twice = r"setts=ts=if(eq(N\,9)\,PREV_OUTPTS\,TS)";
    make(&format!("-i whole.webm -c copy -bsf:v {twice} twice.webm"));
    let (times, end) = times_and_end(&video("twice.webm"), "0");
    assert_eq!((times.len(), end.as_str()), (30, ""));
    assert_eq!(times[8], times[9]);
}

/// A recording that begins in the middle of a broadcast: its first pictures cannot be decoded, the others must be
/// tracked.
#[test]
#[ignore = "needs ffmpeg"]
fn a_recording_that_begins_between_key_pictures_is_tracked_from_the_next_one_on() {
    let parent = folder();
    for coded in [
        "libx264 -bf 2",
        "libx265 -x265-params log-level=none",
        "mpeg2video -q:v 4",
    ] {
        let name = coded.split(' ').next().expect("the encoder");
        let coded = format!("-frames:v 90 -c:v {coded} -g 30 {name}.ts");
        ffmpeg_in(parent.path(), &format!("{TEST_PICTURES} {coded}"));
        let (whole, cut) = (
            format!("{name}.ts"),
            parent.path().join(format!("cut-{name}.ts")),
        );
        let bytes = fs::read(parent.path().join(whole)).expect("it was made");
        let packets = bytes.len() / 188;
        fs::write(&cut, &bytes[packets / 6 * 188..]).expect("it is writable");
        let (all, end) = times_and_end(&cut, "0");
        assert_eq!(end, "", "{name}");
        // A few pictures after the first key frame cannot be decoded, either.
        assert!(
            (58..90).contains(&all.len()) && are_even(&all[3..]),
            "{name}: {all:?}"
        );
        let (later, end) = times_and_end(&cut, "20");
        assert_eq!((later.as_slice(), end.as_str()), (&all[20..], ""), "{name}");
    }
}
