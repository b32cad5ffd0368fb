//! Streams of a session at several replicas.

use crate::pair::{Pair, json};
use crate::stream_client::{Received, StreamClient};
use reqwest::StatusCode;
use serde_json::Value;
use std::time::Duration;
use tokio::time::timeout;

/// The close code of a stream that a newer stream of the session has replaced.
const REPLACED: u16 = 4409;

fn answer_of(message: &Value) -> Value {
    let mut answer = message.clone();
    let fields = answer.as_object_mut().expect("an answer");
    fields.retain(|name, _| !matches!(name.as_str(), "checkpoint" | "replayed"));
    answer
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_stream_goes_on_at_another_replica_and_the_old_one_tracks_nothing_more() {
    let pair = Pair::open(&[], 20).await;
    let expected = pair.undisturbed().await;
    let frames = &pair.clip.frames;
    let mut old = StreamClient::open_in_time(pair.replicas[0].address, pair.id, "").await;
    assert_eq!(old.next, 1);
    for number in 1..6 {
        let answer = old.track(&frames[number]).await;
        assert_eq!(answer["checkpoint"], number, "{answer}");
        assert_eq!(answer_of(&answer), expected[number - 1]);
    }
    // As a client does whose connection broke before it had the answers to frames 3 to 5.
    let mut new = StreamClient::open_in_time(pair.replicas[1].address, pair.id, "?from=3").await;
    assert_eq!(new.next, 6);
    for number in 3..6 {
        let answer = new.message().await;
        assert_eq!(answer["replayed"], true);
        assert_eq!(answer["checkpoint"], 5);
        assert_eq!(answer_of(&answer), expected[number - 1]);
    }
    // Frames over the old stream are not tracked.
    old.send(&frames[6]).await;
    assert_eq!(old.receive().await, Received::Closed(REPLACED));
    for number in 6..12 {
        let answer = new.track(&frames[number]).await;
        assert_eq!(answer_of(&answer), expected[number - 1]);
    }
    // Posts and a third stream continue from the new stream's last frame.
    let posted = json(pair.post(0, 12).await, StatusCode::OK).await;
    assert_eq!(posted, expected[11]);
    let answer = new.track(&frames[13]).await;
    assert_eq!(answer_of(&answer), expected[12]);
    let mut third = StreamClient::open_in_time(pair.replicas[0].address, pair.id, "?from=13").await;
    assert_eq!(third.next, 14);
    assert_eq!(answer_of(&third.message().await), expected[12]);
    assert_eq!(answer_of(&third.track(&frames[14]).await), expected[13]);
    let view = json(pair.view(1).await, StatusCode::OK).await;
    assert_eq!(view["frames"], 15);
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_stream_goes_on_that_is_pinged_while_the_store_takes_its_frame() {
    let flags = ["--ping-interval", "100ms", "--store-timeout", "10s"];
    let pair = Pair::open(&flags, 6).await;
    let expected = pair.undisturbed().await;
    let address = pair.replicas[0].address;
    let mut stream = StreamClient::open_in_time(address, pair.id, "").await;
    for number in 1..6 {
        // The paused store queues requests in order: first the frame's, then the ping's.
        pair.redis.pause();
        stream.send(&pair.clip.frames[number]).await;
        let early = timeout(Duration::from_millis(300), stream.receive()).await;
        assert!(early.is_err(), "{early:?} without the store");
        pair.redis.go_on();
        let answer = stream.message().await;
        assert_eq!(answer_of(&answer), expected[number - 1]);
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_frame_of_a_stream_waits_while_the_store_is_away() {
    let mut pair = Pair::open(&["--store-timeout", "1s"], 10).await;
    let expected = pair.undisturbed().await;
    let address = pair.replicas[0].address;
    let mut stream = StreamClient::open_in_time(address, pair.id, "").await;
    for number in 1..10 {
        if number % 3 == 0 {
            pair.redis.stop();
            stream.send(&pair.clip.frames[number]).await;
            while pair.replicas[0].readiness().await == StatusCode::OK {}
            pair.redis.start_again();
        } else {
            stream.send(&pair.clip.frames[number]).await;
        }
        let answer = stream.message().await;
        assert_eq!(answer["checkpoint"], number, "{answer}");
        assert_eq!(answer_of(&answer), expected[number - 1]);
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_stream_that_says_nothing_ends_with_its_session_and_with_a_newer_stream() {
    let flags = ["--ping-interval", "1s"];
    let pair = Pair::open(&flags, 2).await;
    let open = async |replica: usize| {
        StreamClient::open_in_time(pair.replicas[replica].address, pair.id, "").await
    };
    let mut old = open(0).await;
    let mut new = open(1).await;
    // Receives on both streams, so that both answer pings.
    tokio::select! {
        end = old.receive() => assert_eq!(end, Received::Closed(REPLACED)),
        end = new.receive() => panic!("{end:?}"),
    }
    let mut other = open(0).await;
    tokio::select! {
        end = new.receive() => assert_eq!(end, Received::Closed(REPLACED)),
        end = other.receive() => panic!("{end:?}"),
    }
    let deleted = pair.client.delete(pair.url(1, "")).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    let problem = other.message().await;
    assert_eq!(problem["type"], "/docs/problems#session-not-found");
    assert_eq!(other.receive().await, Received::Closed(4404));
}
