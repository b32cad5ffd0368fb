//! `bagtrack track` on a video: the frame it starts at, and the times of frames. Most need ffmpeg.

use crate::command::{
    about, bagtrack, boxes, clip, fails, folder, probe, program, rows, succeeds, success, text,
    video_of,
};
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A small clip, and the flag for its first box.
pub fn small_clip(parent: &Path, name: &str, [width, height]: [&str; 2]) -> (PathBuf, String) {
    let dir = clip(parent, name, &["--width", width, "--height", height]);
    let truth = fs::read_to_string(dir.join("groundtruth_rect.txt")).expect("it is there");
    let [x, y, width, height] = boxes(&truth)[0];
    (
        dir,
        format!("--box={},{},{width},{height}", x - 1.0, y - 1.0),
    )
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_video_gets_the_boxes_of_its_frames_and_a_drawn_video_has_all_of_them() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "even", ["160", "120"]);
    let video = parent.path().join("even.mp4");
    video_of(&dir, &video, 1);
    let drawn = parent.path().join("drawn.mp4");
    let flags = ["--format", "csv", &target, "--seed", "7"];
    let of_folder = succeeds(&[&["track", text(&dir)], &flags[..]].concat());
    let draw = ["--draw", text(&drawn)];
    let of_video = succeeds(&[&["track", text(&video)], &flags[..], &draw].concat());
    let (a, b) = (rows(&of_folder), rows(&of_video));
    assert_eq!((a.len(), b.len()), (12, 12));
    for (index, (a, b)) in a.iter().zip(&b).enumerate() {
        // The frames differ only by the loss of the codec.
        let near = |side: usize| (a.area[side] - b.area[side]).abs() < 3.0;
        assert!(near(0) && near(1), "{a:?} {b:?}");
        assert_eq!((a.frame, a.time), (index as u64, None));
        let time = b.time.expect("frames of a video have times");
        assert!((time - index as f64 / 30.0).abs() < 1e-3, "{b:?}");
    }
    assert_eq!(about(&drawn), "160,120,30/1,12");
    let line = fails(&[&["track", text(&video)], &flags[..], &draw].concat());
    assert!(line.contains("drawn.mp4: it is there"), "{line}");
    // Pictures of a video have numbers.
    let pictures = parent.path().join("pictures");
    let draw = ["--draw", text(&pictures)];
    succeeds(&[&["track", text(&video)], &flags[..], &draw].concat());
    assert!(pictures.join("000011.jpg").is_file());
}

/// The message must say what to do, not just "No such file or directory".
#[test]
fn standard_input_and_addresses_are_told_as_no_files() {
    for source in ["-", "http://127.0.0.1/clip.mp4"] {
        let line = fails(&["track", source, "--box=10,20,30,40"]);
        assert!(line.contains("save the video to a file first"), "{line}");
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn the_start_is_a_frame_or_a_time_and_what_is_before_it_is_passed_over() {
    let parent = folder();
    let (dir, _) = small_clip(parent.path(), "clip", ["160", "120"]);
    let truth = fs::read_to_string(dir.join("groundtruth_rect.txt")).expect("it is there");
    let [x, y, width, height] = boxes(&truth)[9];
    let target = format!("--box={},{},{width},{height}", x - 1.0, y - 1.0);
    // The last three frames alone.
    let rest = parent.path().join("rest");
    fs::create_dir(&rest).expect("the folder is writable");
    for index in 10..=12 {
        let name = format!("{index:04}.jpg");
        fs::copy(dir.join("img").join(&name), rest.join(&name)).expect("it is there");
    }
    let flags = ["--format", "csv", "--start", "9"];
    let alone = rows(&succeeds(&[
        "track",
        text(&rest),
        &target,
        "--format",
        "csv",
    ]));
    let found = rows(&succeeds(
        &[&["track", text(&dir), &target], &flags[..]].concat(),
    ));
    let areas = |rows: &[crate::command::Row]| rows.iter().map(|row| row.area).collect::<Vec<_>>();
    assert_eq!(areas(&found), areas(&alone));
    assert_eq!(
        found.iter().map(|row| row.frame).collect::<Vec<_>>(),
        [9, 10, 11]
    );
    // Without --box the annotation of that frame counts.
    let annotated = rows(&succeeds(&[&["track", text(&dir)], &flags[..]].concat()));
    for (found, expected) in annotated[0]
        .area
        .into_iter()
        .zip([x - 1.0, y - 1.0, width, height])
    {
        assert!((found - expected).abs() < 1e-3, "{annotated:?}");
    }
    // Frame 9 is shown at 0.3 s: it is the first one that is not before 0.28 s.
    let video = parent.path().join("clip.mkv");
    video_of(&dir, &video, 1);
    let of_video = ["track", text(&video), &target, "--format", "csv", "--start"];
    let by_frame = succeeds(&[&of_video[..], &["9"]].concat());
    for time in ["0.28s", "0.3s", "0:00.3", "0:00:00.3"] {
        assert_eq!(
            succeeds(&[&of_video[..], &[time]].concat()),
            by_frame,
            "{time}"
        );
    }
    let by_frame = rows(&by_frame);
    assert_eq!(by_frame.len(), 3);
    assert_eq!((by_frame[0].frame, by_frame[0].time), (9, Some(0.3)));
    for (video, alone) in by_frame.iter().zip(&alone) {
        assert!(
            (video.area[0] - alone.area[0]).abs() < 2.0,
            "{video:?} {alone:?}"
        );
    }
    for (path, start, said) in [
        (&video, "12", "has 12 frames"),
        (&video, "1:00", "has 12 frames"),
        (&dir, "12", "has 12 frames"),
        (&dir, "1s", "frames of a folder have no times"),
    ] {
        let line = fails(&["track", text(path), &target, "--start", start]);
        assert!(line.contains(said), "{start}: {line}");
    }
}

/// Frame n of these videos is of the gray 20 + 4 n. Files with an index are entered in the middle.
#[test]
#[ignore = "needs ffmpeg"]
fn the_start_is_exactly_the_frame_that_is_named_in_each_kind_of_file() {
    let parent = folder();
    let open = "open-gop=1:keyint=20:min-keyint=20";
    let open_264 = format!("libx264 -x264-params {open} -bf 3");
    let open_265 = format!("libx265 -x265-params log-level=none:{open} -bf 3");
    for (name, coded) in [
        // Frames shown before a key frame may depend on it and on earlier ones (open groups of pictures).
        ("open.mp4", &open_264[..]),
        ("open.mkv", &open_264),
        ("open.mov", &open_265),
        // With B-frames, and few key frames.
        ("b.mp4", "libx264 -bf 3 -g 20"),
        ("b.mkv", "libx264 -bf 3 -g 20"),
        // The time scale of this file is one frame, so that a time between two frames is rounded to one of them.
        ("ticks.mp4", "libx264 -bf 0 -video_track_timescale 30"),
        ("late.mov", "mpeg4 -output_ts_offset 3 -g 20"),
        ("golden.webm", "libvpx-vp9 -cpu-used 8 -g 20"),
        // Each third frame has the time of the one before, as in a recording that notes when frames came.
        (
            "burst.mkv",
            "mjpeg -pix_fmt yuvj420p -bsf:v setts=ts='if(eq(mod(N,3),1),N-1,N)/30/TB'",
        ),
        ("stream.ts", "libx264 -bf 3 -g 20"),
        ("old.avi", "mpeg4 -bf 2 -g 20"),
    ] {
        let video = parent.path().join(name);
        let gray = "lum='20+4*N+25*mod(floor(X/8)+floor(Y/8)\\,2)':cb=128:cr=128";
        let source = format!("color=size=96x64:rate=30:duration=1.5,geq={gray}");
        let coded = format!("-c:v {coded} -b:v 2M {name}");
        ffmpeg_in(parent.path(), &format!("-f lavfi -i {source} {coded}"));
        for start in [0, 1, 19, 20, 21, 33, 44] {
            let pictures = parent.path().join(format!("{name}-{start}"));
            let start_at = start.to_string();
            let flags = ["--box=30,20,24,24", "--start", &start_at, "--format", "csv"];
            let out = format!("{}/", text(&pictures));
            let printed = [&["track", text(&video)], &flags[..], &["--draw", &out]].concat();
            let found = rows(&succeeds(&printed));
            let numbers: Vec<u64> = found.iter().map(|row| row.frame).collect();
            assert_eq!(
                numbers,
                (start..45).collect::<Vec<u64>>(),
                "{name} from {start}"
            );
            let picture = image::open(pictures.join(format!("{start:06}.jpg")));
            let picture = picture.expect("it was drawn").into_luma8();
            // A square of the background, away from the box.
            let area = image::imageops::crop_imm(&picture, 66, 58, 4, 4).to_image();
            let sum: f64 = area.pixels().map(|pixel| f64::from(pixel.0[0])).sum();
            let mean = sum / 16.0;
            let dark = if (66 / 8 + 58 / 8) % 2 == 0 {
                0.0
            } else {
                25.0
            };
            // The codec stores luma in the range 16 to 235.
            let expected = (20.0 + dark + 4.0 * start as f64 - 16.0) * 255.0 / 219.0;
            assert!(
                (mean - expected).abs() < 2.3,
                "{name} from {start}: {mean}, not {expected}"
            );
        }
    }
}

/// Runs ffmpeg in a folder.
pub fn ffmpeg_in(folder: &Path, arguments: &str) {
    let mut command = Command::new("ffmpeg");
    let command = command.args(["-v", "error"]).current_dir(folder);
    let command = command.args(arguments.split(' '));
    assert!(
        command.status().expect("ffmpeg starts").success(),
        "{arguments}"
    );
}

pub const TEST_PICTURES: &str = "-f lavfi -i testsrc2=size=160x120:rate=30";

/// The times of the rows of a video, from a frame on, and the line that tells why there are no more.
pub fn times_and_end(video: &Path, start: &str) -> (Vec<f64>, String) {
    let flags = ["--box=50,40,30,30", "--format", "csv", "--start", start];
    let output = bagtrack(&[&["track", text(video)], &flags[..]].concat());
    let printed = String::from_utf8(output.stdout).expect("text");
    let rows = if printed.is_empty() {
        Vec::new()
    } else {
        rows(&printed)
    };
    let times = rows.iter().map(|row| row.time.expect("it has a time"));
    let errors = String::from_utf8(output.stderr).expect("text");
    (times.collect(), errors)
}

/// The length of the video is not known in advance. The file must say that the track ends, or a reader would take the
/// last box for that of all later frames.
#[test]
#[ignore = "needs ffmpeg"]
fn a_track_ends_in_cvat_where_the_video_goes_on_without_known_times() {
    let parent = folder();
    let coded = "-frames:v 20 -c:v libx264 film.avi";
    ffmpeg_in(parent.path(), &format!("{TEST_PICTURES} {coded}"));
    let film = parent.path().join("film.avi");
    let flags = ["--box=50,40,30,30", "--format", "cvat", "--frames"];
    for (count, ends) in [("5", 1), ("19", 0), ("30", 0)] {
        let printed = succeeds(&[&["track", text(&film)], &flags[..], &[count]].concat());
        assert_eq!(
            printed.matches("outside=\"1\"").count(),
            ends,
            "{count}: {printed}"
        );
    }
}

/// Read with the colour matrix of JPEG files, HD videos would be off by 7 of 255 on average.
#[test]
#[ignore = "needs ffmpeg"]
fn a_video_has_the_same_colors_whatever_matrix_they_are_stored_with() {
    let parent = folder();
    let drawn = ["bt601", "bt709"].map(|matrix| {
        let stored = match matrix {
            "bt601" => "smpte170m",
            other => other,
        };
        let (video, drawn) = (format!("{matrix}.mp4"), parent.path().join(matrix));
        let coded =
            format!("-vf scale=out_color_matrix={matrix},format=yuv420p -colorspace {stored}");
        let coded = format!("{coded} -frames:v 3 -c:v libx264 -crf 10 {video}");
        ffmpeg_in(parent.path(), &format!("{TEST_PICTURES} {coded}"));
        let video = parent.path().join(video);
        let flags = ["--box=50,40,30,30", "--draw", text(&drawn)];
        succeeds(&[&["track", text(&video)], &flags[..]].concat());
        let picture = image::open(drawn.join("000000.jpg"));
        picture.expect("it was drawn").into_rgb8()
    });
    let values = drawn[0].iter().zip(drawn[1].iter());
    let differences = values.map(|(a, b)| f64::from(a.abs_diff(*b)));
    let mean = differences.sum::<f64>() / drawn[0].len() as f64;
    assert!(mean < 4.5, "{mean}");
}

/// The last frame depends on pictures before it, which must be decoded even though none of them is tracked.
#[test]
#[ignore = "needs ffmpeg"]
fn a_trimmed_video_is_followed_from_its_last_frame_on() {
    let parent = folder();
    let coded = "-c:v libx264 -x264-params open-gop=1:b-pyramid=normal:keyint=20 -frames:v 90";
    ffmpeg_in(parent.path(), &format!("{TEST_PICTURES} {coded} whole.mp4"));
    ffmpeg_in(
        parent.path(),
        "-ss 0.9 -t 1.1 -i whole.mp4 -c copy trimmed.mp4",
    );
    let video = parent.path().join("trimmed.mp4");
    let (all, end) = times_and_end(&video, "0");
    assert!(all.len() > 25 && end.is_empty(), "{all:?} {end}");
    for start in all.len() - 4..all.len() {
        let (later, end) = times_and_end(&video, &start.to_string());
        assert_eq!(
            (later.as_slice(), end.as_str()),
            (&all[start..], ""),
            "{start}"
        );
    }
}

#[test]
fn images_that_are_not_read_are_told() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let frame = dir.join("img/0003.jpg");
    fs::rename(&frame, dir.join("img/0003.TIF")).expect("it is there");
    let output = bagtrack(&["track", text(&dir), &target]);
    let told = String::from_utf8(output.stderr).expect("text");
    assert!(told.contains("0003.TIF is passed over"), "{told}");
    assert!(output.status.success());
}

/// For example a browser's recording of a screen, which has a frame when something changes.
#[test]
#[ignore = "needs ffmpeg"]
fn frames_that_are_closer_than_the_rate_says_are_all_taken() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let video = parent.path().join("bursts.mkv");
    let bursts = "settb=1/1000,setpts=if(lt(N\\,6)\\,N*5\\,N*60) -vsync passthrough";
    let coded = format!("-vf {bursts} -enc_time_base 1:1000 {}", text(&video));
    ffmpeg_in(&dir, &format!("-framerate 30 -i img/%04d.jpg {coded}"));
    let flags = ["track", text(&video), &target, "--format", "csv"];
    let times = |printed: &str| {
        let rows = rows(printed).into_iter();
        rows.map(|row| (row.frame, row.time.expect("a time")))
            .collect::<Vec<_>>()
    };
    let expected: Vec<(u64, f64)> = (0..12)
        .map(|frame| {
            (
                frame,
                f64::from(frame as u32 * if frame < 6 { 5 } else { 60 }) / 1000.0,
            )
        })
        .collect();
    assert_eq!(times(&succeeds(&flags)), expected);
    let from_four = [&flags[..], &["--start", "4"]].concat();
    assert_eq!(times(&succeeds(&from_four)), expected[4..]);
}

/// Phones record frames at uneven times.
#[test]
#[ignore = "needs ffmpeg"]
fn times_are_those_of_the_video_also_where_its_rate_changes() {
    let parent = folder();
    let (dir, target) = small_clip(parent.path(), "clip", ["160", "120"]);
    let video = parent.path().join("uneven.mp4");
    // Frames from 6 on are 1 s later.
    let late = "-vf settb=1/1000,setpts=PTS+gte(N\\,6)*1000 -vsync vfr";
    let frames = format!("-framerate 30 -i img/%04d.jpg {late} {}", text(&video));
    ffmpeg_in(&dir, &frames);
    let flags = ["track", text(&video), &target, "--format", "csv"];
    let found = rows(&succeeds(&flags));
    assert_eq!(found.len(), 12);
    for row in &found {
        let late = if row.frame >= 6 { 1.0 } else { 0.0 };
        let time = row.time.expect("frames of a video have times");
        assert!(
            (time - row.frame as f64 / 30.0 - late).abs() < 2e-3,
            "{row:?}"
        );
    }
    let found = rows(&succeeds(&[&flags[..], &["--start", "0.5s"]].concat()));
    assert_eq!(found[0].frame, 6);
    // A drawn video must show the frames at the same times, not at their average rate.
    let draw = |name: &str, flags: &[&str]| {
        let drawn = parent.path().join(name);
        succeeds(
            &[
                &["track", text(&video), &target, "--draw", text(&drawn)],
                flags,
            ]
            .concat(),
        );
        shown_at(&drawn)
    };
    let late = |index: usize, from: usize| index as f64 / 30.0 + f64::from(u8::from(index >= from));
    // In ten frames from frame 9 back, the break is before frame 5.
    let backwards = ["--backwards", "--start", "9"];
    for (name, flags, count, from) in [
        ("drawn.mp4", &[][..], 12, 6),
        ("drawn.mov", &[], 12, 6),
        ("drawn.mkv", &[], 12, 6),
        ("drawn.webm", &[], 12, 6),
        ("drawn.gif", &[], 12, 6),
        ("back.mp4", &backwards, 10, 4),
        ("later.mp4", &["--start", "3"], 9, 3),
    ] {
        let times = draw(name, flags);
        assert_eq!(times.len(), count, "{name}: {times:?}");
        for (index, time) in times.iter().enumerate() {
            // GIF rounds times to hundredths of a second, Matroska to thousandths.
            assert!(
                (time - late(index, from)).abs() < 6e-3,
                "{name}, {index}: {times:?}"
            );
        }
    }
    // An AVI has one rate: 12 frames in the seconds that they are shown.
    let times = draw("drawn.avi", &[]);
    assert_eq!(times.len(), 12, "{times:?}");
    for pair in times.windows(2) {
        assert!((pair[1] - pair[0] - times[1]).abs() < 1e-3, "{times:?}");
    }
}

/// When each frame of a video is shown, in seconds.
pub fn shown_at(video: &Path) -> Vec<f64> {
    let told = probe(video, "-select_streams v:0 -show_entries frame=pts_time");
    let times = told.lines().map(|line| line.trim_end_matches(','));
    // ffprobe prints an additional empty line for the side data of some frames.
    let times = times.filter(|time| !time.is_empty());
    times.map(|time| time.parse().expect("a time")).collect()
}

/// The boxes of MP4 in these bytes, each with its head.
fn mp4_boxes(mut bytes: &[u8]) -> Vec<&[u8]> {
    let mut boxes = Vec::new();
    while let Some(length) = bytes.first_chunk() {
        let (first, rest) = bytes.split_at(u32::from_be_bytes(*length) as usize);
        boxes.push(first);
        bytes = rest;
    }
    boxes
}

/// The cover must not be taken for the video, and a name that is no UTF-8 must reach ffmpeg unchanged.
#[test]
#[ignore = "needs ffmpeg"]
fn a_cover_before_the_tracks_is_no_track_and_a_name_may_be_no_text() {
    let parent = folder();
    let path = |name: &str| parent.path().join(name);
    ffmpeg_in(
        parent.path(),
        &format!("{TEST_PICTURES} -frames:v 12 plain.mp4"),
    );
    ffmpeg_in(parent.path(), "-i plain.mp4 -frames:v 1 cover.jpg");
    let with_cover =
        "-i plain.mp4 -i cover.jpg -map 0 -map 1 -c copy -disposition:v:1 attached_pic";
    ffmpeg_in(parent.path(), &format!("{with_cover} behind.mp4"));
    let behind = fs::read(path("behind.mp4")).expect("it was written");
    // The index is the last box. Its entries about the whole file come before those of the tracks.
    let index = mp4_boxes(&behind).pop().expect("it has boxes");
    let before = &behind[..behind.len() - index.len() + 8];
    let inner = mp4_boxes(&index[8..]).into_iter();
    let (mut about, tracks): (Vec<&[u8]>, Vec<_>) =
        inner.partition(|inner| &inner[4..8] != b"trak");
    about.extend(tracks);
    let front = path("front.mp4");
    fs::write(&front, [before, &about.concat()].concat()).expect("the folder is writable");
    let first = probe(
        &front,
        "-select_streams v:0 -show_entries stream=codec_name",
    );
    assert_eq!(first.trim(), "mjpeg");
    let no_text = parent.path().join(OsStr::from_bytes(b"front \xff.mp4"));
    fs::rename(front, &no_text).expect("the folder is writable");
    let mut command = Command::new(program("bagtrack"));
    let command = command.arg("track").arg(no_text);
    let command = command.args(["--box=10,20,30,40", "--format", "csv"]);
    let printed = success(command.output().expect("it starts"));
    assert_eq!(rows(&printed).len(), 12, "{printed}");
}

#[test]
#[ignore = "needs ffmpeg"]
fn what_is_no_video_is_told_in_one_line() {
    let parent = folder();
    let file = parent.path().join("noise.mp4");
    fs::write(&file, [7; 500]).expect("the folder is writable");
    let line = fails(&["track", text(&file), "--box", "1,2,30,40"]);
    assert!(
        line.contains("noise.mp4") && line.contains("cannot be decoded"),
        "{line}"
    );
    let line = fails(&["track", text(&file)]);
    assert!(line.contains("--box x,y,width,height is needed"), "{line}");
    for (name, start, told) in [
        (
            "photo.mov",
            &b"\0\0\0\x18ftypheic\0\0\0\0mif1heic"[..],
            "is a photo (HEIC)",
        ),
        ("page.mp4", b"<!doctype html>\n", "is a text, not a video"),
        ("cut.mp4", b"", "is empty"),
        ("clip.zip", b"PK\x03\x04\x14\0", "is packed (ZIP)"),
    ] {
        let file = parent.path().join(name);
        fs::write(&file, start).expect("the folder is writable");
        let line = fails(&["track", text(&file), "--box", "1,2,30,40"]);
        assert!(line.contains(name) && line.contains(told), "{line}");
    }
}
