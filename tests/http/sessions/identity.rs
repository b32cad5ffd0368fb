//! Sessions under ids that their clients have made.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use reqwest::{Method, RequestBuilder, StatusCode};
use std::time::Duration;

const ID: &str = "0190c3a2-7b1e-7c58-9d5f-3b8f0c6f2a11";

fn put(app: &TestApplication, id: &str, query: &[(&str, &str)]) -> RequestBuilder {
    let request = app.request(Method::PUT, &format!("/sessions/{id}"), query);
    request.body(pictures::png(0))
}

#[tokio::test]
async fn the_same_request_gets_the_same_answer_also_after_a_frame() {
    let app = TestApplication::start().await;
    let first = put(&app, ID, &[("box", BOX)]).send().await.unwrap();
    assert_eq!(first.status(), StatusCode::CREATED);
    assert_eq!(first.headers()["location"], format!("/sessions/{ID}"));
    assert!(!first.headers().contains_key("replayed"));
    let body = first.text().await.unwrap();
    assert!(body.contains(ID), "{body}");
    app.track(ID, 1).await;
    app.clock.advance(Duration::from_secs(30));

    let again = put(&app, ID, &[("box", BOX)]).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::CREATED);
    assert_eq!(again.headers()["replayed"], "true");
    assert_eq!(again.text().await.unwrap(), body, "the seed was drawn once");
    assert_eq!(app.frames_of(ID).await, 2, "the session goes on");
}

#[tokio::test]
async fn another_request_for_the_same_id_is_refused() {
    let app = TestApplication::start().await;
    let query = [("box", BOX), ("seed", "7")];
    let opened = put(&app, ID, &query).send().await.unwrap();
    assert_eq!(opened.status(), StatusCode::CREATED);
    for other in [
        put(&app, ID, &[("box", BOX), ("seed", "8")]),
        put(&app, ID, &query).body(pictures::png(1)),
    ] {
        expect_problem(other.send().await.unwrap(), "session-exists").await;
    }
    assert_eq!(app.frames_of(ID).await, 1);
    expect(app.delete_session(ID).await, StatusCode::NO_CONTENT).await;
    let anew = put(&app, ID, &[("box", BOX), ("seed", "8")]);
    assert_eq!(anew.send().await.unwrap().status(), StatusCode::CREATED);
}

#[tokio::test]
async fn an_id_that_is_no_uuid_and_a_key_beside_an_id_are_refused() {
    let app = TestApplication::start().await;
    let named = put(&app, "my-session", &[("box", BOX)]);
    expect_problem(named.send().await.unwrap(), "malformed-request").await;
    let twice = put(&app, ID, &[("box", BOX)]).header("idempotency-key", "key");
    expect_problem(twice.send().await.unwrap(), "malformed-request").await;
    expect_problem(app.get_session(ID).await, "session-not-found").await;
}
