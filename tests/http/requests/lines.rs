//! Answers as lines of JSON.

use crate::application::{TestApplication, expect, expect_problem};
use crate::helpers::heavy;
use crate::pictures;
use crate::requests::forms::form;
use bagtrack_testing::within::within;
use reqwest::{Response, StatusCode};
use serde_json::Value;
use std::time::Duration;

pub const LINES: &str = "application/x-ndjson";

/// The lines of an answer; the last one must end with a line break, too.
pub async fn lines(response: Response) -> Vec<Value> {
    let status = response.status();
    let media_type = response.headers()["content-type"].clone();
    let text = response.text().await.unwrap();
    assert_eq!(status, StatusCode::OK, "{text}");
    assert_eq!(media_type, LINES);
    assert!(text.ends_with('\n'), "{text}");
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

async fn post(
    app: &TestApplication,
    id: &str,
    query: &[(&str, &str)],
    frames: Vec<Vec<u8>>,
) -> Response {
    let request = app.frames_request(id, query);
    let request = request.header("accept", LINES);
    request.multipart(form(frames)).send().await.unwrap()
}

fn frames(numbers: std::ops::RangeInclusive<u32>) -> Vec<Vec<u8>> {
    numbers.map(pictures::png).collect()
}

/// The answers of plain posts to the frames 1 to `last`.
pub async fn posted(app: &TestApplication, last: u32) -> Vec<Value> {
    let id = app.open().await;
    let mut answers = Vec::new();
    for t in 1..=last {
        answers.push(app.track(&id, t).await);
    }
    answers
}

#[tokio::test]
async fn each_frame_gets_the_answer_of_a_plain_post_as_a_line() {
    let app = TestApplication::start().await;
    let expected = posted(&app, 13).await;
    let id = app.open().await;
    assert_eq!(
        lines(post(&app, &id, &[], frames(1..=12)).await).await,
        expected[..12]
    );
    // One frame is a line, too.
    assert_eq!(
        lines(post(&app, &id, &[], frames(13..=13)).await).await,
        expected[12..]
    );
}

#[tokio::test]
async fn frames_before_a_bad_one_count_and_its_problem_is_the_last_line() {
    let app = TestApplication::start().await;
    let expected = posted(&app, 6).await;
    let id = app.open().await;
    let mut bad = frames(1..=6);
    bad[3] = b"no image".to_vec();
    let mut got = lines(post(&app, &id, &[("frame", "1")], bad).await).await;
    let last = got.pop().unwrap();
    assert_eq!(got, expected[..3]);
    assert_eq!(last["type"], "/docs/problems#unsupported-image");
    assert_eq!(last["status"], 415);
    assert_eq!(last["index"], 3);
    assert_eq!(last["instance"], format!("/sessions/{id}/frames"));
    assert_eq!(app.frames_of(&id).await, 4);

    // Sent again without the fault: answered frames get their stored answers, and the rest is tracked.
    let mut got = lines(post(&app, &id, &[("frame", "1")], frames(1..=6)).await).await;
    for answer in &mut got[..3] {
        let replayed = answer.as_object_mut().unwrap().remove("replayed");
        assert_eq!(replayed, Some(true.into()));
    }
    assert_eq!(got, expected);
    assert_eq!(app.frames_of(&id).await, 7);
}

#[tokio::test]
async fn a_refused_first_frame_is_the_answer_to_the_request() {
    let (app, id) = TestApplication::with_session().await;
    let other_size = post(&app, &id, &[], vec![pictures::png_of(64, 48)]).await;
    expect_problem(other_size, "frame-size-mismatch").await;
    let early = post(&app, &id, &[("frame", "40")], frames(1..=2)).await;
    let problem = expect_problem(early, "frame-out-of-order").await;
    assert_eq!(problem["expected_frame"], 1);
    lines(post(&app, &id, &[("frame", "1")], frames(1..=2)).await).await;
    let differs = post(&app, &id, &[("frame", "2")], frames(5..=6)).await;
    expect_problem(differs, "frame-differs").await;
    assert_eq!(app.frames_of(&id).await, 3);
}

#[tokio::test]
async fn the_pixels_of_all_frames_together_are_bounded() {
    let pixels = u64::from(pictures::WIDTH * pictures::HEIGHT);
    let app = TestApplication::start_with(|config| {
        config.limits.max_request_pixels = 3 * pixels;
    });
    let app = app.await;
    let id = app.open().await;
    lines(post(&app, &id, &[], frames(1..=3)).await).await;
    let refused = post(&app, &id, &[], frames(4..=7)).await;
    expect_problem(refused, "request-too-costly").await;
    assert_eq!(app.frames_of(&id).await, 4);
}

#[tokio::test]
async fn the_processor_time_of_all_frames_together_is_bounded() {
    // More time than one of these frames takes, and less than all of them take.
    let app = TestApplication::start_with(|config| {
        config.limits.max_request_cpu = Duration::from_millis(300);
        config.max_frames = 400;
    });
    let app = app.await;
    let session = heavy::open(&app).await;
    let request = heavy::post(&app, &session, 400).header("accept", LINES);
    let mut got = lines(request.send().await.unwrap()).await;
    let last = got.pop().unwrap();
    assert_eq!(last["type"], "/docs/problems#request-too-costly");
    let detail = last["detail"].as_str().unwrap();
    // Without lines, the text says instead that no frame was tracked.
    let cure = "Send fewer or smaller frames in a request. The lines before this one count.";
    assert!(detail.ends_with(cure), "{detail}");
    assert!((1..400).contains(&got.len()), "{} lines", got.len());
}

#[tokio::test]
async fn the_last_frame_has_to_be_tracked_in_the_time_of_one_request() {
    // A frame takes some hundredths of this time.
    let app = TestApplication::start_with(|config| {
        config.limits.max_request_cpu = Duration::from_secs(600);
        config.work_timeout = Duration::from_secs(1);
        config.max_frames = 2 * heavy::FRAMES;
    });
    let app = app.await;
    let begun = async {
        loop {
            let session = heavy::open(&app).await;
            let request = heavy::post(&app, &session, 2 * heavy::FRAMES);
            let answer = request.header("accept", LINES).send().await.unwrap();
            // On a busy machine, the first frame alone may take this time: try again.
            if answer.status() == StatusCode::OK {
                break (session, answer);
            }
            expect_problem(answer, "work-timeout").await;
        }
    };
    let (session, answer) = within(begun, "a frame is tracked in time").await;
    let mut got = lines(answer).await;
    let last = got.pop().unwrap();
    assert_eq!(last["type"], "/docs/problems#work-timeout", "{last}");
    // The frame that was at work may be tracked, although its line is missing.
    let view = expect(app.get(&session).await, StatusCode::OK).await;
    let tracked = view["frames"].as_u64().unwrap() - 1;
    assert!((0..=1).contains(&(tracked - got.len() as u64)), "{tracked}");
}
