//! The memory that streams take while they are idle, or have received a part of a message.

use crate::application::{TestApplication, bound_bodies, expect, expect_problem};
use crate::pictures;
use crate::stream_client::{Received, StreamClient};
use bagtrack_testing::within::within;
use reqwest::StatusCode;
use std::time::Duration;

/// The head of a binary message of 100,000 bytes, masked with zeros.
const HEAD: [u8; 14] = [0x82, 0xFF, 0, 0, 0, 0, 0, 1, 0x86, 0xA0, 0, 0, 0, 0];

async fn small_memory() -> TestApplication {
    TestApplication::start_with(|config| bound_bodies(config, 150_000, 300_000)).await
}

#[tokio::test]
async fn idle_streams_take_no_memory_of_uploads() {
    let app = small_memory().await;
    let mut streams = Vec::new();
    for _ in 0..20 {
        let id = app.open().await;
        streams.push((StreamClient::open(app.address, &id, "").await, id));
    }
    // After a message, streams are as small again.
    for (stream, id) in &mut streams {
        stream.send(vec![0; 99_999]).await;
        let answer = stream.message().await;
        assert_eq!(answer["type"], "/docs/problems#unsupported-image");
        assert_eq!(app.frames_of(id).await, 1);
    }
    let id = app.open().await;
    let mut padded = pictures::png(1);
    padded.resize(140_000, 0);
    expect(app.post_frame(&id, padded).await, StatusCode::OK).await;
}

#[tokio::test]
async fn a_part_of_a_message_is_charged_until_its_stream_ends() {
    let app = small_memory().await;
    let (id, other) = (app.open().await, app.open().await);
    let mut stream = StreamClient::open(app.address, &id, "").await;
    stream.send_raw(&HEAD).await;
    let post = || {
        let mut padded = pictures::png(1);
        padded.resize(140_000, 0);
        app.post_frame(&other, padded)
    };
    expect(post().await, StatusCode::OK).await;
    stream.send_raw(&[0; 99_000]).await;
    let full = async { while post().await.status() == StatusCode::OK {} };
    within(full, "what has arrived is counted").await;
    expect_problem(post().await, "quota-exceeded").await;
    // The rest of the message comes, and is answered.
    stream.send_raw(&[0; 1000]).await;
    let answer = stream.message().await;
    assert_eq!(answer["type"], "/docs/problems#unsupported-image");
    expect(post().await, StatusCode::OK).await;
}

#[tokio::test]
async fn a_message_waits_until_there_is_memory_for_it() {
    let app = small_memory().await;
    let (id, other) = (app.open().await, app.open().await);
    let mut first = StreamClient::open(app.address, &id, "").await;
    let mut second = StreamClient::open(app.address, &other, "").await;
    first.send_raw(&HEAD).await;
    first.send_raw(&[0; 99_000]).await;
    let taken = async { while app.post_frame(&id, vec![1; 140_000]).await.status() != 429 {} };
    within(taken, "what has arrived is counted").await;
    second.send(vec![0; 90_000]).await;
    drop(first);
    let answer = second.message().await;
    assert_eq!(answer["type"], "/docs/problems#unsupported-image");
}

#[tokio::test]
async fn a_message_that_does_not_end_ends_its_stream() {
    let app = TestApplication::start_with(|config| {
        config.body_timeout = Duration::from_millis(200);
    });
    let app = app.await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    // Between messages there is no time limit.
    tokio::time::sleep(Duration::from_millis(300)).await;
    stream.send(pictures::png(1)).await;
    assert_eq!(stream.message().await["frame"], 1);
    stream.send_raw(&HEAD).await;
    stream.send_raw(&[0; 10]).await;
    let problem = stream.message().await;
    assert_eq!(problem["type"], "/docs/problems#body-timeout");
    assert!(matches!(stream.receive().await, Received::Closed(4408)));
}
