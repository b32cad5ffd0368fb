//! The store forgets sessions: it keeps nothing on a disk, or it was out of reach for longer than they live without a
//! frame. A replica that has the state goes on from it.

use crate::pair::{Pair, json};
use crate::stream_client::StreamClient;
use reqwest::{Response, StatusCode};

async fn must_come_again(answer: Response) {
    assert!(answer.headers().contains_key("retry-after"));
    let problem = json(answer, StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(problem["type"], "/docs/problems#store-unavailable");
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn the_newest_copy_goes_on_and_an_older_one_does_not() {
    let pair = Pair::open(&[], 12).await;
    let expected = pair.undisturbed().await;
    for number in 1..4 {
        json(pair.post(1, number).await, StatusCode::OK).await;
    }
    for number in 4..7 {
        json(pair.post(0, number).await, StatusCode::OK).await;
    }
    pair.redis.ask(&["flushall"]);
    // The second replica has frame 3, and the client has the answer to frame 6.
    must_come_again(pair.post(1, 7).await).await;
    for number in 7..9 {
        let answer = pair.post(0, number).await;
        assert_eq!(answer.headers()["checkpoint"], number.to_string().as_str());
        assert_eq!(json(answer, StatusCode::OK).await, expected[number - 1]);
    }
    for number in 9..12 {
        let answer = json(pair.post(number % 2, number).await, StatusCode::OK).await;
        assert_eq!(answer, expected[number - 1], "frame {number}");
    }
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_session_outlives_a_store_that_is_away_for_longer_than_it_lives_without_a_frame() {
    let pair = Pair::open(&["--session-idle", "3s"], 8).await;
    let expected = pair.undisturbed().await;
    json(pair.post(0, 1).await, StatusCode::OK).await;
    pair.redis.pause();
    let paused = std::time::Instant::now();
    while paused.elapsed().as_secs() < 5 {
        must_come_again(pair.post(0, 2).await).await;
    }
    pair.redis.go_on();
    for number in 2..8 {
        let answer = loop {
            let answer = pair.post(0, number).await;
            if answer.status() != StatusCode::SERVICE_UNAVAILABLE {
                break json(answer, StatusCode::OK).await;
            }
        };
        assert_eq!(answer, expected[number - 1], "frame {number}");
    }
    while pair.replicas[1].readiness().await != StatusCode::OK {}
    assert_eq!(
        json(pair.post(1, 7).await, StatusCode::OK).await,
        expected[6]
    );
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_frame_that_is_sent_again_brings_its_session_back() {
    let pair = Pair::open(&[], 5).await;
    let expected = pair.undisturbed().await;
    for number in 1..3 {
        json(pair.post(0, number).await, StatusCode::OK).await;
    }
    pair.redis.ask(&["flushall"]);
    let again = pair.post(0, 2).await;
    assert_eq!(again.headers()["replayed"], "true");
    assert!(!again.headers().contains_key("durable"));
    assert_eq!(json(again, StatusCode::OK).await, expected[1]);
    assert_eq!(
        json(pair.post(1, 3).await, StatusCode::OK).await,
        expected[2]
    );
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_session_that_was_ended_does_not_come_back() {
    let pair = Pair::open(&[], 4).await;
    json(pair.post(0, 1).await, StatusCode::OK).await;
    json(pair.post(1, 2).await, StatusCode::OK).await;
    let ended = pair.client.delete(pair.url(0, "")).send().await.unwrap();
    assert_eq!(ended.status(), StatusCode::NO_CONTENT);
    // The second replica has the state that the frame follows.
    json(pair.post(1, 3).await, StatusCode::NOT_FOUND).await;
    json(pair.post(0, 3).await, StatusCode::NOT_FOUND).await;
    json(pair.view(1).await, StatusCode::NOT_FOUND).await;
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn without_its_number_a_frame_does_not_say_which_copy_it_follows() {
    let pair = Pair::open(&[], 4).await;
    json(pair.post_unnumbered(0, 1).await, StatusCode::OK).await;
    pair.redis.ask(&["flushall"]);
    let refused = pair.post_unnumbered(0, 2).await;
    let problem = json(refused, StatusCode::SERVICE_UNAVAILABLE).await;
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("?frame=2"), "{detail}");
    json(pair.view(0).await, StatusCode::OK).await;
    json(pair.post(0, 2).await, StatusCode::OK).await;
    json(pair.post_unnumbered(1, 3).await, StatusCode::OK).await;
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_stream_goes_on_and_another_replica_takes_it_up() {
    let pair = Pair::open(&[], 9).await;
    let expected = pair.undisturbed().await;
    let frames = &pair.clip.frames;
    let box_of = |answer: &serde_json::Value| answer["box"].clone();
    let mut stream = StreamClient::open(pair.replicas[0].address, pair.id, "").await;
    for number in 1..6 {
        if number == 3 {
            pair.redis.ask(&["flushall"]);
        }
        let answer = stream.track(&frames[number]).await;
        assert_eq!(answer["checkpoint"], number, "{answer}");
        assert_eq!(box_of(&answer), box_of(&expected[number - 1]));
    }
    pair.redis.ask(&["flushall"]);
    // Opened where the state is, and then where it is not.
    let mut second = StreamClient::open(pair.replicas[0].address, pair.id, "?from=6").await;
    assert_eq!(second.next, 6);
    assert_eq!(second.track(&frames[6]).await["frame"], 6);
    let mut third = StreamClient::open(pair.replicas[1].address, pair.id, "?from=7").await;
    let answer = third.track(&frames[7]).await;
    assert_eq!(box_of(&answer), box_of(&expected[6]));
    second.send(&frames[8]).await;
    assert_eq!(second.receive().await, Err(4409));
}
