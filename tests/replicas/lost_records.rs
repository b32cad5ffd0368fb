//! The store loses sessions: it has no disk, or was out of reach for longer than idle sessions live. The service then
//! answers that they are gone, and clients open them again from a snapshot.

use crate::pair::{Pair, json};
use crate::stream_client::{Received, StreamClient};
use reqwest::{Response, StatusCode};

async fn must_be_lost(answer: Response) {
    let problem = json(answer, StatusCode::NOT_FOUND).await;
    assert_eq!(problem["type"], "/docs/problems#session-not-found");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("POST /sessions"), "{detail}");
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_session_that_the_store_has_lost_is_gone_at_all_replicas() {
    let pair = Pair::open(&[], 8).await;
    json(pair.post(0, 1).await, StatusCode::OK).await;
    json(pair.post(1, 2).await, StatusCode::OK).await;
    json(pair.post(0, 3).await, StatusCode::OK).await;
    pair.redis.ask(&["flushall"]);
    // The first replica has the session's state in memory, but not the store.
    let lost = json(pair.post(0, 4).await, StatusCode::NOT_FOUND).await;
    let detail = lost["detail"].as_str().unwrap();
    assert!(detail.contains("lost"), "{detail}");
    must_be_lost(pair.post(0, 4).await).await;
    must_be_lost(pair.post(1, 3).await).await;
    must_be_lost(pair.post(1, 4).await).await;
    must_be_lost(pair.view(0).await).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_lost_session_goes_on_from_its_snapshot_under_the_same_id() {
    let pair = Pair::open(&["--snapshot-keys", "a-secret-of-both-replicas"], 6).await;
    let expected = pair.undisturbed().await;
    pair.take(0, 1..4).await;
    let snapshot = pair.client.get(pair.url(1, "/snapshot")).send().await;
    let snapshot = snapshot.unwrap().bytes().await.unwrap();
    pair.redis.ask(&["flushall"]);
    must_be_lost(pair.post(0, 4).await).await;
    let opened = pair.client.put(pair.url(1, "")).body(snapshot).send().await;
    json(opened.unwrap(), StatusCode::CREATED).await;
    for number in 4..6 {
        let answer = json(pair.post(number % 2, number).await, StatusCode::OK).await;
        assert_eq!(answer, expected[number - 1], "frame {number}");
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn the_stream_of_a_lost_session_ends_and_says_why() {
    let pair = Pair::open(&[], 4).await;
    let mut stream = StreamClient::open_in_time(pair.replicas[0].address, pair.id, "").await;
    assert_eq!(stream.track(&pair.clip.frames[1]).await["checkpoint"], 1);
    pair.redis.ask(&["flushall"]);
    stream.send(&pair.clip.frames[2]).await;
    let problem = stream.message().await;
    assert_eq!(problem["type"], "/docs/problems#session-not-found");
    assert_eq!(stream.receive().await, Received::Closed(4404));
}
