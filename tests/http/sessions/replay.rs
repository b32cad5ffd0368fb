//! Numbered frames.

use crate::application::{TestApplication, expect, expect_problem};
use crate::pictures;
use reqwest::{Response, StatusCode};
use serde_json::Value;

async fn expect_answer(response: Response, replayed: bool) -> Value {
    let header = response.headers().get("replayed").cloned();
    assert_eq!(
        header.as_ref().map(|value| value.as_bytes()),
        replayed.then_some(&b"true"[..])
    );
    expect(response, StatusCode::OK).await
}

#[tokio::test]
async fn a_frame_sent_again_gets_the_stored_answer() {
    let app = TestApplication::start().await;
    let id = app.open().await;
    let first = expect_answer(app.post_numbered(&id, 1, pictures::png(1)).await, false).await;
    let again = expect_answer(app.post_numbered(&id, 1, pictures::png(1)).await, true).await;
    assert_eq!(first, again);
    assert_eq!(app.frames_of(&id).await, 2);

    let differs = app.post_numbered(&id, 1, pictures::png(2)).await;
    let problem = expect_problem(differs, "frame-differs").await;
    assert_eq!(
        (
            problem["status"].as_u64(),
            problem["expected_frame"].as_u64()
        ),
        (Some(409), Some(2))
    );
    for number in [3, (1 << 53) - 1] {
        let response = app.post_numbered(&id, number, pictures::png(1)).await;
        let problem = expect_problem(response, "frame-out-of-order").await;
        assert_eq!(
            (
                problem["status"].as_u64(),
                problem["expected_frame"].as_u64()
            ),
            (Some(409), Some(2))
        );
    }
    assert_eq!(app.frames_of(&id).await, 2);
    expect_answer(app.post_numbered(&id, 2, pictures::png(2)).await, false).await;
    // Without a number the same bytes are the next frame.
    let next = expect_answer(app.post_frame(&id, pictures::png(2)).await, false).await;
    assert_eq!(next["frame"], 3);
    // Its answer may have been lost while others were on their way.
    let late = expect_answer(app.post_numbered(&id, 1, pictures::png(1)).await, true).await;
    assert_eq!(late, first);
    assert_eq!(app.frames_of(&id).await, 4);
}

#[tokio::test]
async fn the_first_frame_can_be_asked_for_again() {
    let app = TestApplication::start().await;
    let id = app.open().await;
    let answer = expect_answer(app.post_numbered(&id, 0, pictures::png(0)).await, true).await;
    assert_eq!(answer["frame"], 0);
    assert_eq!(answer["box"]["x"], 20.0);
}
