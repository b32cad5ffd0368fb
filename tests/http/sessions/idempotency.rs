//! A request to open a session that is sent again with its `Idempotency-Key`.

use crate::application::{BOX, TestApplication, behind_a_proxy, expect, expect_problem};
use crate::operation::metrics::{metrics, value};
use crate::pictures;
use reqwest::multipart::{Form, Part};
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use std::time::Duration;

/// `POST /sessions` for frame `t`, with this key.
fn opening(app: &TestApplication, key: &str, t: u32) -> RequestBuilder {
    let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
    request
        .header("idempotency-key", key)
        .body(pictures::png(t))
}

async fn id_of(response: Response) -> String {
    let created = expect(response, StatusCode::CREATED).await;
    created["id"].as_str().unwrap().to_owned()
}

async fn sessions(app: &TestApplication) -> f64 {
    value(&metrics(app).await, "bagtrack_sessions", &[])
}

#[tokio::test]
async fn the_same_request_gets_the_same_answer_and_opens_no_second_session() {
    let app = TestApplication::start().await;
    let first = opening(&app, "key-1", 0).send().await.unwrap();
    let location = first.headers()["location"].clone();
    assert!(!first.headers().contains_key("replayed"));
    let body = first.bytes().await.unwrap();
    let again = opening(&app, "key-1", 0).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::CREATED);
    assert_eq!(again.headers()["location"], location);
    assert_eq!(again.headers()["replayed"], "true");
    assert_eq!(again.headers()["content-type"], "application/json");
    assert_eq!(
        again.bytes().await.unwrap(),
        body,
        "the seed was drawn once"
    );
    // The same frame and box in another form.
    let form = Form::new()
        .text("box", BOX)
        .part("frame", Part::bytes(pictures::png(0)).file_name("a.png"));
    let request = app.request(Method::POST, "/sessions", &[]).multipart(form);
    let again = request
        .header("idempotency-key", "key-1")
        .send()
        .await
        .unwrap();
    assert_eq!(again.bytes().await.unwrap(), body);
    assert_eq!(sessions(&app).await, 1.0);

    let other = opening(&app, "key-1", 1).send().await.unwrap();
    expect_problem(other, "idempotency-key-reused").await;
    opening(&app, "key-2", 1).send().await.unwrap();
    assert_eq!(sessions(&app).await, 2.0);
}

#[tokio::test]
async fn requests_at_the_same_time_open_one_session() {
    let app = TestApplication::start().await;
    let requests = (0..12).map(|_| opening(&app, "key", 0).send());
    let responses = futures_util::future::join_all(requests).await;
    let mut ids = Vec::new();
    for response in responses {
        ids.push(id_of(response.unwrap()).await);
    }
    ids.dedup();
    assert_eq!(ids.len(), 1);
    assert_eq!(sessions(&app).await, 1.0);
}

#[tokio::test]
async fn a_stored_answer_is_given_when_there_is_no_room_and_goes_with_its_session() {
    let app = TestApplication::start_with(|config| config.max_sessions = 1).await;
    let id = id_of(opening(&app, "key", 0).send().await.unwrap()).await;
    assert_eq!(
        id_of(opening(&app, "key", 0).send().await.unwrap()).await,
        id
    );
    let full = opening(&app, "other", 0).send().await.unwrap();
    expect_problem(full, "too-many-sessions").await;
    app.clock.advance(Duration::from_secs(60));
    let next = id_of(opening(&app, "key", 0).send().await.unwrap()).await;
    assert_ne!(next, id, "an answer that names a dead session is of no use");
}

#[tokio::test]
async fn without_api_keys_each_address_has_keys_of_its_own() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.limits.client_sessions = Some(1);
    });
    let app = app.await;
    let open = async |client: &str, key: &str, t: u32| {
        let request = opening(&app, key, t).header("x-forwarded-for", client);
        request.send().await.unwrap()
    };
    let one = id_of(open("198.51.100.1", "key", 0).await).await;
    // Keys of one client do not affect those of another, with the same request or a different one.
    let other = id_of(open("198.51.100.2", "key", 0).await).await;
    assert_ne!(one, other);
    id_of(open("198.51.100.3", "key", 1).await).await;
    assert_eq!(id_of(open("198.51.100.1", "key", 0).await).await, one);
    // A client with its full share of sessions is refused before its frame is read.
    let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
    let request = request
        .header("idempotency-key", "new")
        .header("x-forwarded-for", "198.51.100.1");
    let refused = request.body("no image").send().await.unwrap();
    expect_problem(refused, "quota-exceeded").await;
}
