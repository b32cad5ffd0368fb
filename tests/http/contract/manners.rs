//! How answers read for people, and the version that they name.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use bagtrack::http::Secret;
use reqwest::{Method, StatusCode};
use serde_json::Value;

#[tokio::test]
async fn answers_end_with_a_newline() {
    let (app, id) = TestApplication::with_session().await;
    let answers = [
        app.create(pictures::png(0), &[("box", BOX)]).await,
        app.create(b"no image".to_vec(), &[("box", BOX)]).await,
        app.post_frame(&id, pictures::png(1)).await,
        app.put_target(&id, pictures::png(2), &[("box", BOX)]).await,
        app.get_session(&id).await,
        app.get("/nowhere").await,
        app.get("/healthz").await,
        app.get("/readyz").await,
        app.get("/openapi.json").await,
    ];
    for answer in answers {
        let url = answer.url().clone();
        let text = answer.text().await.unwrap();
        assert!(text.ends_with("}\n"), "{url}: {text}");
    }
}

/// How many digits the number has after the point.
fn digits(value: &Value) -> usize {
    let text = value.to_string();
    text.split_once('.').map_or(0, |(_, digits)| digits.len())
}

#[tokio::test]
async fn numbers_have_as_many_digits_as_they_mean() {
    let (app, id) = TestApplication::with_session().await;
    let mut most = [0, 0];
    for t in 1..=10 {
        let answer = app.post_numbered(&id, t, pictures::png(t as u32)).await;
        let text = answer.text().await.unwrap();
        let again = app.post_numbered(&id, t, pictures::png(t as u32)).await;
        assert_eq!(again.text().await.unwrap(), text, "byte by byte");
        let answer: Value = serde_json::from_str(&text).unwrap();
        for side in ["x", "y", "width", "height"] {
            most[0] = most[0].max(digits(&answer["box"][side]));
        }
        most[1] = most[1].max(digits(&answer["score"]));
    }
    assert_eq!(most, [2, 3]);
    let created = app.opened(&[("box", "20.00499,15,16.126,12")]).await;
    let given = serde_json::json!({"x": 20.0, "y": 15.0, "width": 16.13, "height": 12.0});
    assert_eq!(created["box"], given);
}

#[tokio::test]
async fn the_parameters_are_named_when_that_is_asked_for() {
    let app = TestApplication::start().await;
    let path = format!("/sessions/{}", uuid::Uuid::new_v4());
    let put = async |verbose: Option<&str>| {
        let mut query = vec![("box", BOX), ("seed", "7")];
        query.extend(verbose.map(|text| ("verbose", text)));
        let request = app.request(Method::PUT, &path, &query);
        expect(
            request.body(pictures::png(0)).send().await.unwrap(),
            StatusCode::CREATED,
        )
        .await
    };
    // The same id each time, so the session is only opened once.
    for quiet in [None, Some("false"), Some("0")] {
        assert!(put(quiet).await.get("parameters").is_none());
    }
    for verbose in ["", "true", "1"] {
        assert_eq!(put(Some(verbose)).await["parameters"]["seed"], 7);
    }
    let refused = app
        .create(pictures::png(0), &[("box", BOX), ("verbose", "very")])
        .await;
    assert_eq!(refused.status(), StatusCode::BAD_REQUEST);
}

#[tokio::test]
async fn the_version_is_told_to_everybody() {
    let app = TestApplication::start_with(|config| {
        config.access.api_keys = vec![Secret::from("me:0123456789abcdef")];
    });
    let mut app = app.await;
    app.key = None;
    let version = expect(app.get("/version").await, StatusCode::OK).await;
    assert_eq!(version["name"], "bagtrack");
    assert_eq!(version["version"], env!("CARGO_PKG_VERSION"));
    expect_problem(app.get("/version?of=all").await, "malformed-request").await;
}
