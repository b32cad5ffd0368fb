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
    let (app, id) = TestApplication::with_session().await;
    let first = expect_answer(app.post_numbered(&id, 1, pictures::png(1)).await, false).await;
    let again = expect_answer(app.post_numbered(&id, 1, pictures::png(1)).await, true).await;
    assert_eq!(first, again);
    assert_eq!(app.frames_of(&id).await, 2);

    for (number, slug) in [
        (1, "frame-differs"),
        (3, "frame-out-of-order"),
        ((1 << 53) - 1, "frame-out-of-order"),
    ] {
        let refused = app.post_numbered(&id, number, pictures::png(2)).await;
        let problem = expect_problem(refused, slug).await;
        assert_eq!(problem["status"], 409);
        assert_eq!(problem["expected_frame"], 2);
    }
    assert_eq!(app.frames_of(&id).await, 2);
}
