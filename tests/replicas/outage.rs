//! What happens while the store is away and `--store-mode` is `best-effort`, and after that.

use crate::pair::{Pair, json};
use crate::replica::Replica;
use reqwest::{Response, StatusCode};
use serde_json::Value;

/// A busy machine is no store that is away; one that has ended is so at once.
const FLAGS: [&str; 4] = ["--store-mode", "best-effort", "--store-timeout", "3s"];

fn says_not_durable(answer: &Response) -> bool {
    let durable = answer.headers().get("durable");
    durable.is_some_and(|value| value == "false")
}

async fn must_come_again(answer: Response) {
    assert!(answer.headers().contains_key("retry-after"));
    let problem = json(answer, StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(problem["type"], "/docs/problems#store-unavailable");
}

/// Opens a session without an id of its own; its path.
async fn open_unnamed(pair: &Pair, replica: usize, name: Option<&str>) -> Response {
    let query = format!("/sessions?seed=7&box={}", pair.clip.first_box);
    let mut request = pair.client.post(pair.replicas[replica].url(&query));
    if let Some(name) = name {
        request = request.header("idempotency-key", name);
    }
    let request = request.body(pair.clip.frames[0].clone());
    request.send().await.unwrap()
}

/// Posts a frame of the session at this path.
async fn post_to(pair: &Pair, at: &Replica, path: &str, number: usize) -> Response {
    let url = at.url(&format!("{path}/frames?frame={number}"));
    let request = pair.client.post(url).body(pair.clip.frames[number].clone());
    request.send().await.unwrap()
}

/// A frame again and again, until the replica has found the store, and the answer is durable.
async fn post_until_durable(pair: &Pair, at: &Replica, path: &str, number: usize) -> Value {
    loop {
        let answer = post_to(pair, at, path, number).await;
        let is_away = answer.status() == StatusCode::SERVICE_UNAVAILABLE;
        if !is_away && !says_not_durable(&answer) {
            assert_eq!(answer.headers()["checkpoint"], number.to_string().as_str());
            return json(answer, StatusCode::OK).await;
        }
    }
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_session_that_is_not_in_memory_may_be_elsewhere_while_the_store_is_away() {
    let mut pair = Pair::open(&FLAGS, 4).await;
    json(pair.post(0, 1).await, StatusCode::OK).await;
    pair.redis.stop();
    // The first replica has the session, the second cannot know.
    must_come_again(pair.post(1, 2).await).await;
    must_come_again(pair.view(1).await).await;
    must_come_again(pair.put(1, 7).await).await;
    must_come_again(open_unnamed(&pair, 1, Some("a-key")).await).await;
    assert_eq!(pair.put(0, 7).await.headers()["replayed"], "true");
    let answer = pair.post(0, 2).await;
    assert!(says_not_durable(&answer));
    json(answer, StatusCode::OK).await;
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_repeated_answer_says_whether_its_frame_is_durable() {
    let mut pair = Pair::open(&FLAGS, 4).await;
    let path = format!("/sessions/{}", pair.id);
    json(pair.post(0, 1).await, StatusCode::OK).await;
    pair.redis.stop();
    for is_repeated in [false, true, true] {
        let answer = pair.post(0, 2).await;
        assert!(says_not_durable(&answer));
        assert_eq!(answer.headers()["checkpoint"], "1");
        assert_eq!(answer.headers().contains_key("replayed"), is_repeated);
    }
    pair.redis.start_again();
    // The answer that is durable is a repeated one, and another replica has its frame.
    let last = post_until_durable(&pair, &pair.replicas[0], &path, 2).await;
    let again = post_until_durable(&pair, &pair.replicas[1], &path, 2).await;
    assert_eq!(last, again);
    post_until_durable(&pair, &pair.replicas[1], &path, 3).await;
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_session_that_was_opened_without_the_store_is_written_when_it_is_back() {
    let mut pair = Pair::open(&FLAGS, 5).await;
    let expected = pair.undisturbed().await;
    pair.redis.stop();
    let mut paths = Vec::new();
    for _ in 0..2 {
        let opened = open_unnamed(&pair, 0, None).await;
        assert!(says_not_durable(&opened));
        assert!(!opened.headers().contains_key("checkpoint"));
        paths.push(opened.headers()["location"].to_str().unwrap().to_owned());
        json(opened, StatusCode::CREATED).await;
    }
    for path in &paths {
        for number in 1..3 {
            let answer = post_to(&pair, &pair.replicas[0], path, number).await;
            assert!(says_not_durable(&answer));
            assert_eq!(json(answer, StatusCode::OK).await, expected[number - 1]);
        }
    }
    pair.redis.start_again();
    // The first session gets a frame, the second none before the replica is asked to end.
    let answer = post_until_durable(&pair, &pair.replicas[0], &paths[0], 3).await;
    assert_eq!(answer, expected[2]);
    pair.replicas[0].end();
    for (path, number) in paths.iter().zip([4, 3]) {
        let answer = post_until_durable(&pair, &pair.replicas[1], path, number).await;
        assert_eq!(answer, expected[number - 1]);
    }
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn frames_without_numbers_go_on_where_the_last_ones_are_in_memory_only() {
    let mut pair = Pair::open(&FLAGS, 3).await;
    json(pair.post_unnumbered(0, 1).await, StatusCode::OK).await;
    pair.redis.stop();
    let answer = pair.post_unnumbered(0, 2).await;
    assert!(says_not_durable(&answer));
    pair.redis.start_again();
    pair.redis.ask(&["flushall"]);
    for number in 3.. {
        let answer = pair.post_unnumbered(0, 1).await;
        let is_durable = !says_not_durable(&answer);
        assert_eq!(json(answer, StatusCode::OK).await["frame"], number);
        if is_durable {
            break;
        }
    }
    while pair.view(1).await.status() == StatusCode::SERVICE_UNAVAILABLE {}
    let view = json(pair.view(0).await, StatusCode::OK).await;
    assert_eq!(
        json(pair.view(1).await, StatusCode::OK).await["frames"],
        view["frames"]
    );
}
