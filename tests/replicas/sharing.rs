//! Replicas that share one session while nothing fails.

use crate::clip::Clip;
use crate::pair::{Pair, json};
use crate::processes::Redis;
use crate::replica::Replica;
use bagtrack_testing::within::within;
use reqwest::{Client, StatusCode};
use uuid::Uuid;

#[tokio::test]
#[ignore = "needs redis"]
async fn frames_without_numbers_are_taken_in_turns_but_not_at_once() {
    let pair = Pair::open(&[], 3).await;
    for number in 1..7 {
        let answer = json(pair.post_unnumbered(number % 2).await, StatusCode::OK);
        assert_eq!(answer.await["frame"], number);
    }
    let posts = (0..6).map(|n| pair.post_unnumbered(n % 2));
    let mut numbers = Vec::new();
    for answer in futures_util::future::join_all(posts).await {
        match answer.status() {
            StatusCode::OK => {
                let answer = json(answer, StatusCode::OK).await;
                numbers.push(answer["frame"].as_u64().unwrap());
            }
            _ => {
                let problem = json(answer, StatusCode::CONFLICT).await;
                assert_eq!(problem["type"], "/docs/problems#not-in-order");
            }
        }
    }
    numbers.sort_unstable();
    let last = *numbers.last().expect("one of them is taken");
    assert_eq!(numbers, (7..=last).collect::<Vec<_>>());
    for replica in 0..2 {
        let view = json(pair.view(replica).await, StatusCode::OK).await;
        assert_eq!(view["frames"], last + 1);
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_session_is_opened_once_and_ended_everywhere() {
    let pair = Pair::open(&[], 3).await;
    let first = pair.put(0, 7).await.text().await.unwrap();
    let again = pair.put(1, 7).await;
    assert_eq!(again.status(), StatusCode::CREATED);
    assert_eq!(again.headers()["replayed"], "true");
    assert_eq!(again.headers()["checkpoint"], "0");
    assert_eq!(again.text().await.unwrap(), first);
    let other = json(pair.put(1, 8).await, StatusCode::CONFLICT).await;
    assert_eq!(other["type"], "/docs/problems#session-exists");

    let keyed = async |replica: usize| {
        let query = format!("/sessions?box={}", pair.clip.first_box);
        let request = pair.client.post(pair.replicas[replica].url(&query));
        let request = request.header("idempotency-key", "a-key");
        let request = request.body(pair.clip.frames[0].clone());
        json(request.send().await.unwrap(), StatusCode::CREATED).await
    };
    assert_eq!(keyed(0).await, keyed(1).await);

    json(pair.post(1, 1).await, StatusCode::OK).await;
    let delete = pair.client.delete(pair.url(1, "")).send().await.unwrap();
    assert_eq!(delete.status(), StatusCode::NO_CONTENT);
    for replica in 0..2 {
        json(pair.post(replica, 2).await, StatusCode::NOT_FOUND).await;
        json(pair.view(replica).await, StatusCode::NOT_FOUND).await;
    }
    // Another session under the same id is not mistaken for the first.
    json(pair.put(0, 9).await, StatusCode::CREATED).await;
    json(pair.post(1, 1).await, StatusCode::OK).await;
    json(pair.post(0, 2).await, StatusCode::OK).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn sessions_belong_to_their_keys_at_every_replica_and_expire_everywhere() {
    let redis = Redis::start();
    let flags = [
        "--api-keys",
        "ann:0123456789abcdef,ben:fedcba9876543210",
        "--session-first",
        "1s",
    ];
    let replica = || Replica::with_store(&redis.url(), &flags);
    let (first, second) = (replica(), replica());
    let (client, clip) = (Client::new(), Clip::of(0, 2));
    let open = async || {
        let id = Uuid::new_v4();
        let query = format!("/sessions/{id}?box={}", clip.first_box);
        let request = client
            .put(first.url(&query))
            .bearer_auth("0123456789abcdef");
        let opened = request.body(clip.frames[0].clone()).send().await.unwrap();
        json(opened, StatusCode::CREATED).await;
        id
    };
    let view = async |id: Uuid, key: &str| {
        let request = client.get(second.url(&format!("/sessions/{id}")));
        request.bearer_auth(key).send().await.unwrap()
    };
    // On a busy machine, a session may expire before it is read: try again.
    let seen = async {
        loop {
            let id = open().await;
            json(view(id, "fedcba9876543210").await, StatusCode::NOT_FOUND).await;
            if view(id, "0123456789abcdef").await.status() == StatusCode::OK {
                break id;
            }
        }
    };
    let id = within(seen, "a session is seen").await;
    let gone = async {
        loop {
            match view(id, "0123456789abcdef").await.status() {
                // A fast machine may exceed the rate limit.
                StatusCode::OK | StatusCode::TOO_MANY_REQUESTS => {}
                other => break other,
            }
        }
    };
    let gone = within(gone, "it expires").await;
    assert!(
        matches!(gone, StatusCode::GONE | StatusCode::NOT_FOUND),
        "{gone}"
    );
}
