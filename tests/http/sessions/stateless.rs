//! `POST /track`: tracking without a session.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use crate::requests::forms::{form, part};
use bagtrack::http::Secret;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use reqwest::multipart::{Form, Part};
use reqwest::{Method, RequestBuilder, StatusCode};
use serde_json::{Value, json};

const KEYS: &str = "a secret of the replicas";

async fn start() -> TestApplication {
    TestApplication::start_with(|config| {
        config.access.snapshot_keys = vec![Secret::from(KEYS)];
    })
    .await
}

fn track(app: &TestApplication, query: &[(&str, &str)]) -> RequestBuilder {
    app.request(Method::POST, "/track", query)
}

/// The answer without its snapshot, to compare it with a session's answer.
fn answer(tracked: &Value) -> Value {
    let mut answer = tracked.clone();
    answer.as_object_mut().unwrap().remove("snapshot");
    answer
}

async fn step(app: &TestApplication, before: &Value, t: u32) -> Value {
    let frame = STANDARD.encode(pictures::png(t));
    let body = json!({"frame": frame, "snapshot": before["snapshot"]});
    expect(
        track(app, &[]).json(&body).send().await.unwrap(),
        StatusCode::OK,
    )
    .await
}

#[tokio::test]
async fn snapshots_between_two_services_give_the_boxes_of_a_session() {
    let apps = [start().await, start().await];
    let id = apps[0].open().await;
    let first = track(&apps[0], &[("box", BOX), ("seed", "7")]).body(pictures::png(0));
    let mut tracked = expect(first.send().await.unwrap(), StatusCode::OK).await;
    assert_eq!(tracked["frame"], 0);
    for t in 1..8 {
        tracked = step(&apps[t as usize % 2], &tracked, t).await;
        let session = apps[0].post_frame(&id, pictures::png(t)).await;
        assert_eq!(answer(&tracked), expect(session, StatusCode::OK).await);
    }
    // The snapshot opens a session, too.
    let bytes = STANDARD
        .decode(tracked["snapshot"].as_str().unwrap())
        .unwrap();
    let opened = expect(apps[1].create(bytes, &[]).await, StatusCode::CREATED).await;
    assert_eq!(opened["frame"], 7);
    // The service keeps no state: the same request gets the same answer.
    assert_eq!(
        step(&apps[0], &tracked, 8).await,
        step(&apps[1], &tracked, 8).await
    );
}

#[tokio::test]
async fn a_form_takes_several_frames_and_a_box_corrects_one() {
    let app = start().await;
    let form = form((0..4).map(pictures::png));
    let query = [("box", BOX), ("seed", "7")];
    let batch = track(&app, &query).multipart(form).send().await.unwrap();
    let batch = expect(batch, StatusCode::OK).await;
    let first = track(&app, &query).body(pictures::png(0));
    let mut single = expect(first.send().await.unwrap(), StatusCode::OK).await;
    for t in 1..4 {
        assert_eq!(batch["answers"][t as usize - 1], answer(&single));
        single = step(&app, &single, t).await;
    }
    assert_eq!(batch["answers"][3], answer(&single));

    let snapshot = STANDARD
        .decode(batch["snapshot"].as_str().unwrap())
        .unwrap();
    let form = || {
        let form = Form::new().part("frame", part(pictures::png(4)));
        form.part("snapshot", Part::bytes(snapshot.clone()))
    };
    let corrected = track(&app, &[("box", "22,17,16,12")]).multipart(form());
    let corrected = expect(corrected.send().await.unwrap(), StatusCode::OK).await;
    assert_eq!(corrected["frame"], 4);
    assert_eq!(corrected["box"]["x"], 22.0);
    let seeded = track(&app, &[("seed", "8")]).multipart(form());
    expect_problem(seeded.send().await.unwrap(), "malformed-request").await;
}

#[tokio::test]
async fn a_snapshot_of_a_service_with_another_secret_is_refused() {
    let (app, other) = (start().await, TestApplication::start().await);
    let first = track(&other, &[("box", BOX)]).body(pictures::png(0));
    let tracked = expect(first.send().await.unwrap(), StatusCode::OK).await;
    let frame = STANDARD.encode(pictures::png(1));
    let body = json!({"frame": frame, "snapshot": tracked["snapshot"]});
    let refused = track(&app, &[]).json(&body).send().await.unwrap();
    expect_problem(refused, "invalid-snapshot").await;
}
