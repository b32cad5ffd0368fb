//! `POST /track` with a video and a box: a line for each frame, without a session. Most need ffmpeg.

use crate::application::{TestApplication, expect_detail, expect_problem};
use crate::helpers::heavy;
use crate::helpers::video_files::{FRAMES, expect_on_target, motion_jpeg, video};
use crate::operation::metrics::{metrics, value};
use crate::requests::lines::{LINES, lines};
use reqwest::multipart::{Form, Part};
use reqwest::{Method, Response, StatusCode};
use serde_json::Value;
use std::time::Duration;

/// The target's box in the first frame of the videos, `pictures::scene(1)`.
const FIRST: &str = "22,16,16,12";

async fn track(
    app: &TestApplication,
    query: &[(&str, &str)],
    media_type: &str,
    video: Vec<u8>,
) -> Response {
    let request = app.request(Method::POST, "/track", query);
    let request = request.header("content-type", media_type);
    request.body(video).send().await.unwrap()
}

/// A line for each frame, the first with the box that was given.
fn check(lines: &[Value], name: &str) {
    assert_eq!(lines.len(), FRAMES as usize, "{name}: {lines:?}");
    let sides = ["x", "y", "width", "height"].map(|side| lines[0]["box"][side].as_f64().unwrap());
    assert_eq!(sides, [22.0, 16.0, 16.0, 12.0], "{name}");
    for (line, t) in lines.iter().zip(1..) {
        assert_eq!(line["frame"], t - 1, "{name}");
        expect_on_target(line, t);
        assert!(
            line["score"].is_number() && line["status"].is_string(),
            "{line}"
        );
    }
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_video_and_a_box_get_a_line_for_each_frame_and_no_session() {
    let app = TestApplication::start().await;
    let query = [("box", FIRST), ("seed", "7")];
    for (media_type, video) in [
        ("video/mp4", video("mp4")),
        ("video/webm", video("webm")),
        ("image/gif", video("gif")),
        ("video/x-motion-jpeg", motion_jpeg()),
        // The labels that curl and generated clients send.
        ("application/x-www-form-urlencoded", video("mp4")),
        ("application/json", video("mp4")),
    ] {
        let answer = track(&app, &query, media_type, video.clone()).await;
        assert_eq!(answer.status(), StatusCode::OK, "{media_type}");
        assert_eq!(answer.headers()["content-type"], LINES);
        let first = lines(answer).await;
        check(&first, media_type);
        let again = track(&app, &query, media_type, video).await;
        assert_eq!(lines(again).await, first, "the same seed, the same answers");
    }
    let part = Part::bytes(video("mp4")).file_name("clip.mp4");
    let form = Form::new().part("frame", part).text("box", FIRST);
    let request = app.request(Method::POST, "/track", &[]);
    check(
        &lines(request.multipart(form).send().await.unwrap()).await,
        "form",
    );
    let sessions = value(&metrics(&app).await, "bagtrack_sessions", &[]);
    assert_eq!(sessions, 0.0);
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn several_targets_are_followed_through_a_video() {
    let app = TestApplication::start().await;
    let boxes = format!("{FIRST};60,40,16,12");
    let answer = track(&app, &[("boxes", &boxes)], "video/mp4", video("mp4")).await;
    let lines = lines(answer).await;
    assert_eq!(lines.len(), FRAMES as usize);
    for line in &lines {
        assert_eq!(line["targets"].as_array().unwrap().len(), 2, "{line}");
    }
    assert_eq!(lines[0]["targets"][1]["box"]["x"], 60.0);
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn what_is_wrong_with_the_video_or_the_box_is_told() {
    let app = TestApplication::start_with(|config| config.limits.max_video_frames = 5).await;
    let (mp4, first) = (video("mp4"), [("box", FIRST)]);
    let mut got = lines(track(&app, &first, "video/mp4", mp4.clone()).await).await;
    let last = got.pop().unwrap();
    assert_eq!(last["type"], "/docs/problems#too-many-frames");
    assert_eq!(last["instance"], "/track");
    assert_eq!(got.len(), 5);
    for (query, slug) in [
        (&[][..], "missing-box"),
        (&[("box", "500,500,20,20")][..], "invalid-box"),
        (&[("box", "0.2,0.2,0.2,0.2")][..], "invalid-box"),
        (&[("box", FIRST), ("target", "0")][..], "malformed-request"),
    ] {
        let refused = track(&app, query, "video/mp4", mp4.clone()).await;
        expect_problem(refused, slug).await;
    }
    // An AVI file is a video, but of no format that the service reads.
    let avi = [&b"RIFF\0\0\0\0AVI LIST"[..], &[0; 100]].concat();
    let of_video = [("box", FIRST), ("count", "2")];
    let refused = track(&app, &of_video, "video/x-msvideo", avi).await;
    expect_detail(refused, "unsupported-image", &["AVI"]).await;
    let cut = mp4[..mp4.len() / 2].to_vec();
    let refused = track(&app, &first, "video/mp4", cut).await;
    expect_problem(refused, "frame-damaged").await;
    let id = app.open().await;
    let snapshot = Part::bytes(app.snapshot(&id).await);
    let form = Form::new().part("frame", Part::bytes(mp4).file_name("clip.mp4"));
    let request = app.request(Method::POST, "/track", &[]);
    let refused = request
        .multipart(form.part("snapshot", snapshot))
        .send()
        .await;
    expect_problem(refused.unwrap(), "malformed-request").await;
}

/// If the part's type were ignored, only the first picture would count.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn motion_jpeg_in_a_form_has_its_type_at_its_part() {
    let app = TestApplication::start().await;
    for media_type in ["video/x-motion-jpeg", "Video/X-Motion-JPEG; charset=binary"] {
        let part = Part::bytes(motion_jpeg()).mime_str(media_type);
        let request = app.request(Method::POST, "/track", &[("box", FIRST)]);
        let form = Form::new().part("frame", part.unwrap());
        let answer = request.multipart(form).send().await.unwrap();
        assert_eq!(lines(answer).await.len(), FRAMES as usize, "{media_type}");
    }
}

/// Frames before the start must not count towards the limit of frames: else the end of a long video is out of reach.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn frames_before_the_start_do_not_count() {
    let app = TestApplication::start_with(|config| config.limits.max_video_frames = 5).await;
    let numbers = async |query: &[(&str, &str)]| {
        let query = [&[("box", FIRST)], query].concat();
        let lines = lines(track(&app, &query, "video/mp4", video("mp4")).await).await;
        let number = |line: &Value| line["frame"].as_u64().ok_or_else(|| line["detail"].clone());
        lines
            .iter()
            .map(number)
            .collect::<Result<Vec<u64>, Value>>()
    };
    assert_eq!(numbers(&[("start", "8")]).await, Ok(vec![8, 9, 10, 11]));
    let back = [("start", "11"), ("backwards", "true"), ("count", "4")];
    assert_eq!(numbers(&back).await, Ok(vec![11, 10, 9, 8, 7]));
    let detail = numbers(&[("start", "2")]).await.unwrap_err();
    assert!(detail.as_str().unwrap().contains("`start=6`"), "{detail}");
}

/// A client that stops reading keeps its only place for a video, until it disconnects.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs ffmpeg"]
async fn a_client_tracks_one_video_at_a_time_and_its_place_is_free_when_it_goes() {
    let app = TestApplication::start_with(|config| {
        config.work_timeout = Duration::from_secs(4);
    });
    let app = app.await;
    let (motion, first) = ("video/x-motion-jpeg", ("box", FIRST));
    let slow = [first, ("preset", "paper"), ("parameters", heavy::PARAMS)];
    let mut held = track(&app, &slow, motion, motion_jpeg().repeat(200)).await;
    assert_eq!(held.status(), StatusCode::OK);
    held.chunk().await.unwrap().expect("a line");
    let again = track(&app, &[first], motion, motion_jpeg()).await;
    expect_problem(again, "quota-exceeded").await;
    drop(held);
    let then = track(&app, &[first], motion, motion_jpeg()).await;
    check(&lines(then).await, "after");
}
