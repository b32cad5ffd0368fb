//! `POST /track` from a frame of a video on, or back: the same answers as `bagtrack track` with the same options. All
//! need ffmpeg.

use crate::application::{TestApplication, expect_detail, expect_problem};
use crate::requests::lines::lines;
use bagtrack_testing::command;
use reqwest::{Method, Response, StatusCode};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

const FRAMES: u64 = 60;
/// Boxes in frame 30: the target of the sample clip, and a piece of the background.
const BOXES: [&str; 2] = ["55,72,46,58", "200,30,40,40"];

/// The sample clip as an MP4 with B-frames, so that the orders of decoding and display differ; from frame 45 on, the
/// scene is empty. The file is deleted with the returned folder.
fn clip() -> (TempDir, PathBuf) {
    let folder = command::folder();
    let frames = command::clip(folder.path(), "clip", &["--frames", "60"]);
    let empty = image::GrayImage::from_pixel(320, 240, image::Luma([128]));
    for index in 46..=FRAMES {
        empty
            .save(frames.join(format!("img/{index:04}.jpg")))
            .unwrap();
    }
    let video = folder.path().join("clip.mp4");
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-v", "error", "-framerate", "30", "-i"]);
    ffmpeg.arg(frames.join("img/%04d.jpg"));
    ffmpeg.args(["-pix_fmt", "yuv420p", "-bf", "2"]);
    assert!(ffmpeg.arg(&video).status().unwrap().success());
    (folder, video)
}

/// Query parameters of the service that correspond to these flags of the command.
fn settings(flags: &str) -> Vec<(&str, &str)> {
    let flags = flags.split("--").skip(1).map(str::trim);
    let settings = flags.map(|flag| match flag.split_once(' ') {
        Some(("frames", count)) => ("count", count),
        Some(setting) => setting,
        None if flag == "until-lost" => ("until_lost", "true"),
        None => (flag, "true"),
    });
    settings.collect()
}

/// The rows that the command writes.
fn rows(video: &Path, boxes: &[&str], flags: &str) -> Vec<Value> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
    command.arg("track").arg(video);
    command.args(["--format", "json", "--seed", "7"]);
    for given in boxes {
        command.args(["--box", given]);
    }
    let output = command.args(flags.split(' ')).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

async fn track(app: &TestApplication, video: &Path, query: &[(&str, &str)]) -> Response {
    let request = app.request(Method::POST, "/track", query);
    let body = std::fs::read(video).unwrap();
    request.body(body).send().await.unwrap()
}

fn frame_of(value: &Value) -> u64 {
    value["frame"].as_u64().unwrap()
}

/// Checks that the service's answer for a target equals the command's row.
fn check_same(answer: &Value, row: &Value) {
    for side in ["x", "y", "width", "height"] {
        let of = |value: &Value| value["box"][side].as_f64().unwrap();
        // Answers have two places after the point.
        assert!((of(answer) - of(row)).abs() < 0.00501, "{answer} {row}");
    }
    assert_eq!(answer["status"], row["status"], "{answer} {row}");
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_box_goes_through_a_video_as_with_the_command() {
    let (_folder, video) = clip();
    let app = TestApplication::start().await;
    for (flags, least) in [
        ("--start 30", 30),
        ("--start 30 --frames 5", 6),
        ("--start 30 --backwards", 31),
        ("--start 30 --backwards --frames 4", 5),
        ("--start 30 --until-lost", 16),
        ("--start 30 --keyframes", 4),
        ("--start 30 --backwards --keyframes", 3),
        ("--start 30 --until-lost --keyframes", 3),
    ] {
        let query = [&[("box", BOXES[0]), ("seed", "7")], &settings(flags)[..]].concat();
        let answers = lines(track(&app, &video, &query).await).await;
        let rows = rows(&video, &BOXES[..1], flags);
        let numbers = |values: &[Value]| values.iter().map(frame_of).collect::<Vec<u64>>();
        assert_eq!(numbers(&answers), numbers(&rows), "{flags:?}");
        assert!(rows.len() >= least, "{flags:?}: {}", rows.len());
        for (answer, row) in answers.iter().zip(&rows) {
            check_same(answer, row);
        }
    }
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn the_lines_of_several_targets_are_the_key_frames_of_each() {
    let (_folder, video) = clip();
    let app = TestApplication::start().await;
    let boxes = BOXES.join(";");
    let query = [
        ("boxes", boxes.as_str()),
        ("seed", "7"),
        ("start", "30"),
        ("count", "10"),
        ("keyframes", "true"),
    ];
    let answers = lines(track(&app, &video, &query).await).await;
    let rows = rows(&video, &BOXES, "--start 30 --frames 10 --keyframes");
    let frames: Vec<u64> = answers.iter().map(frame_of).collect();
    let expected: BTreeSet<u64> = rows.iter().map(frame_of).collect();
    assert_eq!(frames, Vec::from_iter(expected));
    assert!(frames.len() < 11, "{frames:?}");
    for row in &rows {
        let answer = answers.iter().find(|it| frame_of(it) == frame_of(row));
        let target = usize::try_from(row["target"].as_u64().unwrap()).unwrap();
        check_same(&answer.unwrap()["targets"][target], row);
    }
}

/// The file that the command writes for the first box, with further flags.
fn file(video: &Path, format: &str, flags: &[&str]) -> String {
    let written = video.with_file_name(format!("written.{format}"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
    command.arg("track").arg(video);
    command.args(["--format", format, "--seed", "7", "--box", BOXES[0]]);
    command.args(flags).arg("-o");
    let output = command.arg(&written).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(&written).unwrap();
    std::fs::remove_file(written).unwrap();
    text
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_video_is_answered_by_the_file_that_the_command_writes() {
    let (_folder, video) = clip();
    let app = TestApplication::start().await;
    let both = BOXES.join(";");
    let named = ["--box", BOXES[1], "--name", "a <van>", "--name", "ground"];
    for (format, media_type) in [
        ("text", "text/plain; charset=utf-8"),
        ("json", "application/x-ndjson"),
        ("csv", "text/csv; charset=utf-8"),
        ("mot", "text/plain; charset=utf-8"),
        ("coco", "application/json"),
        ("cvat", "application/xml"),
        ("label-studio", "application/json"),
    ] {
        for flags in [
            "--start 30",
            "--start 30 --frames 9",
            "--start 30 --backwards",
        ] {
            let given = [
                ("boxes", both.as_str()),
                ("names", "a <van>, ground"),
                ("video_name", "clip.mp4"),
                ("seed", "7"),
                ("format", format),
            ];
            let query = [&given[..], &settings(flags)].concat();
            let answer = track(&app, &video, &query).await;
            assert_eq!(answer.status(), 200, "{format}: {answer:?}");
            assert_eq!(answer.headers()["content-type"], media_type);
            let flags: Vec<&str> = flags.split(' ').chain(named).collect();
            let expected = file(&video, format, &flags);
            assert!(expected.len() > 500, "{format}: {expected}");
            assert!(
                answer.text().await.unwrap() == expected,
                "{format} {flags:?}"
            );
        }
    }
    let otb = [("box", BOXES[0]), ("seed", "7"), ("format", "otb")];
    let answer = track(&app, &video, &otb).await.text().await.unwrap();
    assert_eq!(answer, file(&video, "otb", &[]));
    // With a rate, times are counted by it, and those of the video are ignored.
    let query = [
        ("box", BOXES[0]),
        ("seed", "7"),
        ("format", "json"),
        ("rate", "10"),
        ("count", "3"),
    ];
    let answer = lines(track(&app, &video, &query).await).await;
    let times: Vec<f64> = answer
        .iter()
        .map(|row| row["time"].as_f64().unwrap())
        .collect();
    assert_eq!(times, [0.0, 0.1, 0.2, 0.3]);
}

/// The problem must say how to get the frames before the damage.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_file_of_a_damaged_video_is_had_of_the_frames_before_the_damage() {
    let (_folder, video) = clip();
    let app = TestApplication::start().await;
    let mut bytes = std::fs::read(&video).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 500].fill(0x5A);
    std::fs::write(&video, bytes).unwrap();
    let query = [("box", BOXES[0]), ("format", "csv")];
    let refused = track(&app, &video, &query).await;
    let problem = expect_problem(refused, "frame-damaged").await;
    let detail = problem["detail"].as_str().unwrap();
    let (_, rest) = detail
        .split_once("`count=")
        .unwrap_or_else(|| panic!("{detail}"));
    let count = rest.split_once('`').unwrap().0;
    let query = [&query[..], &[("count", count)]].concat();
    let answer = track(&app, &video, &query).await;
    assert_eq!(answer.status(), StatusCode::OK, "{detail}");
    let rows = answer.text().await.unwrap().lines().count();
    let count: usize = count.parse().unwrap();
    assert_eq!(rows, count + 2, "a head, the first frame, and these");
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_file_that_cannot_be_written_is_refused_before_the_video_is_tracked() {
    let (folder, video) = clip();
    let app = TestApplication::start().await;
    let both = BOXES.join(";");
    let one = ("box", BOXES[0]);
    for (query, word) in [
        (
            &[("boxes", both.as_str()), ("format", "otb")][..],
            "one target a file",
        ),
        (
            &[one, ("format", "coco"), ("keyframes", "true")],
            "another format for key frames",
        ),
        (
            &[one, ("format", "yolo")],
            "expected one of `text`, `json`, `csv`",
        ),
        (
            &[one, ("format", "cvat"), ("names", "van,rider")],
            "2 names, for 1 box.",
        ),
        (
            &[one, ("format", "cvat"), ("names", "van\u{1}")],
            "no control characters",
        ),
        (&[one, ("format", "csv"), ("rate", "0")], "frames a second"),
        (&[one, ("names", "van")], "give its `format`"),
    ] {
        let refused = track(&app, &video, query).await;
        expect_detail(refused, "malformed-request", &[word]).await;
    }
    let jpeg = folder.path().join("clip/img/0001.jpg");
    let refused = track(&app, &jpeg, &[one, ("format", "csv")]).await;
    expect_detail(refused, "malformed-request", &["for a video"]).await;
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn frames_that_are_kept_for_the_way_back_are_charged_as_uploads() {
    let (_folder, video) = clip();
    let size = usize::try_from(video.metadata().unwrap().len()).unwrap();
    // Memory for the video, and for about ten frames of 14 KiB.
    let app = TestApplication::start_with(|config| {
        config.max_body_bytes = 2 * size;
        config.max_upload_bytes = 2 * size + (160 << 10);
    });
    let app = app.await;
    let query = [("box", BOXES[0]), ("start", "40"), ("backwards", "true")];
    let refused = track(&app, &video, &query).await;
    assert!(
        matches!(refused.status().as_u16(), 429 | 503),
        "{refused:?}"
    );
    let few = [&query[..], &[("count", "5")]].concat();
    assert_eq!(lines(track(&app, &video, &few).await).await.len(), 6);
    // Tracking forwards keeps no frames.
    let forwards = [("box", BOXES[0]), ("start", "40")];
    assert_eq!(lines(track(&app, &video, &forwards).await).await.len(), 20);
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_frame_that_is_not_there_and_frames_in_place_of_a_video_are_refused() {
    let (folder, video) = clip();
    let app = TestApplication::start().await;
    for (query, word) in [
        (("start", "60"), "no frame 60: it has 60"),
        (("backwards", "true"), "give `start`"),
        (("start", "-1"), "-1"),
    ] {
        let refused = track(&app, &video, &[("box", BOXES[0]), query]).await;
        expect_detail(refused, "malformed-request", &[word]).await;
    }
    let jpeg = folder.path().join("clip/img/0001.jpg");
    for query in [
        ("start", "3"),
        ("until_lost", "true"),
        ("keyframes", "true"),
    ] {
        let refused = track(&app, &jpeg, &[("box", BOXES[0]), query]).await;
        expect_detail(refused, "malformed-request", &["for a video"]).await;
    }
}
