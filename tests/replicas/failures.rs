//! What happens when a replica ends, or the store is away.

use crate::clip::Clip;
use crate::pair::{Pair, json};
use crate::processes::Redis;
use crate::replica::Replica;
use crate::tracking_client::Track;
use reqwest::{Client, Response, StatusCode};

/// The header `Checkpoint`: the frame up to which the store has the session.
fn checkpoint(answer: &Response) -> Option<&str> {
    let value = answer.headers().get("checkpoint")?;
    Some(value.to_str().unwrap())
}

async fn until_ready(replica: &Replica, status: StatusCode) {
    while replica.readiness().await != status {}
}

/// After a replica has ended, its frames since the checkpoint are asked for again; the Rust client keeps them.
#[tokio::test]
#[ignore = "needs redis"]
async fn the_client_sends_the_frames_after_the_checkpoint_again() {
    let redis = Redis::start();
    let replica = || Replica::with_store(&redis.url(), &["--store-every", "10"]);
    let (mut first, second) = (replica(), replica());
    for replica in [&first, &second] {
        until_ready(replica, StatusCode::OK).await;
    }
    let clip = Clip::of(0, 30);
    let alone = Replica::start(&[]);
    let undisturbed = Track::open(alone.url(""), Client::new(), 3, clip.clone());
    let expected = undisturbed.await.follow().await;
    let client = bagtrack_client::Client::builder(first.url("")).or_at(second.url(""));
    let mut track = Track::open_by(client.build().unwrap(), 3, clip).await;
    for _ in 1..=25 {
        track.advance().await;
    }
    assert!(!track.went_back());
    first.kill();
    while track.advance().await {}
    assert_eq!(track.answers, expected);
    assert_eq!(track.resent(), 5, "frames 21 to 25");
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_replica_that_is_asked_to_end_writes_what_it_has() {
    let mut pair = Pair::open(&["--store-every", "100"], 12).await;
    for number in 1..=10 {
        let answer = pair.post(0, number).await;
        assert_eq!(checkpoint(&answer), Some("0"));
    }
    pair.replicas[0].end();
    let answer = pair.post(1, 11).await;
    assert_eq!(checkpoint(&answer), Some("10"));
    json(answer, StatusCode::OK).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_replica_that_lost_a_session_to_another_goes_on_from_the_store() {
    let pair = Pair::open(&["--store-every", "4"], 20).await;
    let expected = pair.undisturbed().await;
    pair.take(0, 1..7).await;
    // The second replica takes over at the checkpoint. The first still has frames 5 and 6 in memory.
    let early = json(pair.post(1, 7).await, StatusCode::CONFLICT).await;
    assert_eq!(early["expected_frame"], 5);
    pair.follow(1, 5..7, &expected).await;
    // The second replica has the session, so frame 6 in the first one's memory does not count any more.
    let stale = json(pair.post(0, 7).await, StatusCode::CONFLICT).await;
    assert_eq!(stale["expected_frame"], 5);
    pair.follow(0, 5..20, &expected).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_frame_that_comes_late_to_another_replica_takes_nothing_back() {
    let pair = Pair::open(&["--store-every", "10"], 20).await;
    // The second replica has only the first frame of the session, so it expects frame 1.
    let early = json(pair.post(1, 19).await, StatusCode::CONFLICT).await;
    assert_eq!(early["expected_frame"], 1);
    pair.take(0, 1..15).await;
    for number in [1, 2, 10] {
        let late = pair.post(1, number).await;
        assert_eq!(late.headers()["replayed"], "true", "frame {number}");
        json(late, StatusCode::OK).await;
    }
    let next = json(pair.post(0, 15).await, StatusCode::OK).await;
    assert_eq!(next["frame"], 15);
}
