//! A store that is reachable, but refuses writes, or is slow.

use crate::pair::{Pair, json};
use reqwest::{Response, StatusCode};
use std::time::{Duration, Instant};

async fn must_come_again(answer: Response) {
    assert!(answer.headers().contains_key("retry-after"));
    let problem = json(answer, StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(problem["type"], "/docs/problems#store-unavailable");
}

/// The value of a metric of the first replica; `None` if it does not have the metric.
async fn metric(pair: &Pair, name: &str) -> Option<f64> {
    let page = pair.client.get(pair.replicas[0].url("/metrics")).send();
    let text = page.await.unwrap().text().await.unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().parse().ok()
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_store_that_does_not_allow_writes_is_not_ready() {
    let allow = |right| ["acl", "setuser", "default", right];
    let pair = Pair::open(&[], 5).await;
    json(pair.post(0, 1).await, StatusCode::OK).await;
    assert_eq!(metric(&pair, "bagtrack_store_up").await, Some(1.0));
    assert_eq!(
        metric(&pair, "bagtrack_store_failures_total").await,
        Some(0.0)
    );
    pair.redis.ask(&allow("-hset"));
    must_come_again(pair.post(0, 2).await).await;
    while pair.replicas[0].readiness().await == StatusCode::OK {}
    // The state lasts for more than two probes of the store.
    let found = Instant::now();
    while found.elapsed() < Duration::from_millis(700) {
        assert_ne!(pair.replicas[0].readiness().await, StatusCode::OK);
    }
    assert_eq!(metric(&pair, "bagtrack_store_up").await, Some(0.0));
    assert!(metric(&pair, "bagtrack_store_failures_total").await > Some(0.0));
    // Requests that need no write are answered.
    assert_eq!(json(pair.view(0).await, StatusCode::OK).await["frames"], 2);
    must_come_again(pair.post(0, 2).await).await;
    pair.redis.ask(&allow("+hset"));
    while pair.replicas[0].readiness().await != StatusCode::OK {}
    assert_eq!(metric(&pair, "bagtrack_store_up").await, Some(1.0));
    json(pair.post(0, 2).await, StatusCode::OK).await;
    json(pair.post(1, 3).await, StatusCode::OK).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_session_can_be_ended_where_the_memory_is_used_up() {
    let pair = Pair::open(&[], 3).await;
    pair.redis.ask(&["config", "set", "maxmemory", "1"]);
    let ended = pair.client.delete(pair.url(0, "")).send().await.unwrap();
    assert_eq!(ended.status(), StatusCode::NO_CONTENT);
    json(pair.post(1, 1).await, StatusCode::NOT_FOUND).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_session_whose_state_is_damaged_in_the_store_can_be_ended() {
    let pair = Pair::open(&[], 3).await;
    pair.redis.ask(&["hset", &pair.key(), "state", "damaged"]);
    let damaged = json(pair.view(1).await, StatusCode::INTERNAL_SERVER_ERROR).await;
    assert_eq!(damaged["type"], "/docs/problems#internal");
    let ended = pair.client.delete(pair.url(1, "")).send().await.unwrap();
    assert_eq!(ended.status(), StatusCode::NO_CONTENT);
    for replica in [0, 1] {
        json(pair.post(replica, 1).await, StatusCode::NOT_FOUND).await;
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_store_that_gives_no_answer_is_waited_for_once() {
    const PATIENCE: Duration = Duration::from_secs(3);
    let pair = Pair::open(&["--store-timeout", "3s"], 8).await;
    let expected = pair.undisturbed().await;
    pair.take(0, 1..4).await;
    pair.redis.pause();
    let asked = Instant::now();
    must_come_again(pair.post(0, 4).await).await;
    let first = asked.elapsed();
    while pair.replicas[0].readiness().await == StatusCode::OK {}
    let asked = Instant::now();
    for _ in 0..4 {
        must_come_again(pair.post(0, 4).await).await;
    }
    let others = asked.elapsed();
    // Besides the patience: time for tracking, and for a busy machine.
    assert!(first < 2 * PATIENCE, "{first:?}");
    assert!(others < PATIENCE, "{others:?}");
    pair.redis.go_on();
    while pair.replicas[0].readiness().await != StatusCode::OK {}
    pair.follow(0, 4..8, &expected).await;
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_frame_that_is_taken_renews_the_time_to_live_and_a_refused_one_does_not() {
    let flags = ["--session-first", "20s", "--session-idle", "100s"];
    let pair = Pair::open(&flags, 3).await;
    let key = pair.key();
    let lives = || -> u64 { pair.redis.ask(&["pttl", &key]).trim().parse().unwrap() };
    assert!(lives() <= 20_000);
    json(pair.post_as(0, 5, 1).await, StatusCode::CONFLICT).await;
    assert!(lives() <= 20_000);
    for number in 1..3 {
        json(pair.post(0, number).await, StatusCode::OK).await;
        assert!(lives() > 50_000, "{}", lives());
        pair.redis.ask(&["pexpire", &key, "20000"]);
        // Sends the frame again, to the replica that has not answered it.
        json(pair.post(1, number).await, StatusCode::OK).await;
        assert!(lives() > 50_000, "{}", lives());
        pair.redis.ask(&["pexpire", &key, "20000"]);
    }
}
