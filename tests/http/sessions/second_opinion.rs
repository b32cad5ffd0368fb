//! A service with a network that gives a second opinion of each frame.

use crate::application::{TestApplication, expect, expect_detail};
use crate::pictures;
use bagtrack_testing::tiny_network;
use reqwest::StatusCode;
use serde_json::Value;
use std::path::Path;

/// A service with the network in `folder`, used in each frame or in doubtful ones only.
async fn with_network(folder: &Path, in_doubt: bool) -> TestApplication {
    let model = tiny_network::write(folder).unwrap();
    TestApplication::start_with(|config| {
        config.model = Some(model.parse().expect("two files"));
        config.model_in_doubt = in_doubt;
        config.access.unsigned_snapshots = true;
    })
    .await
}

/// The answers to `frames` of the clip.
async fn answers(app: &TestApplication, id: &str, frames: std::ops::Range<u32>) -> Vec<Value> {
    let mut answers = Vec::new();
    for t in frames {
        let posted = app.post_frame(id, pictures::png(t)).await;
        answers.push(expect(posted, StatusCode::OK).await);
    }
    answers
}

#[tokio::test]
async fn a_session_has_the_second_opinion_and_goes_on_where_the_same_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let app = with_network(folder.path(), false).await;
    let id = app.open().await;
    let with = answers(&app, &id, 1..12).await;
    let plain = TestApplication::start_with(|config| config.access.unsigned_snapshots = true).await;
    let alone = plain.open().await;
    assert_ne!(answers(&plain, &alone, 1..12).await, with);

    let snapshot = app.snapshot(&id).await;
    let other = with_network(folder.path(), false).await;
    let restored = expect(
        other.create(snapshot.clone(), &[]).await,
        StatusCode::CREATED,
    )
    .await;
    let again = restored["id"].as_str().unwrap();
    assert_eq!(
        answers(&other, again, 12..20).await,
        answers(&app, &id, 12..20).await
    );

    let refused = plain.create(snapshot.clone(), &[]).await;
    expect_detail(refused, "invalid-snapshot", &["--model"]).await;
    let in_doubt = with_network(folder.path(), true).await;
    let refused = in_doubt.create(snapshot, &[]).await;
    expect_detail(refused, "invalid-snapshot", &["--model-in-doubt"]).await;
}
