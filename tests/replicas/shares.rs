//! What one client may have in the store that replicas share.

use crate::clip::Clip;
use crate::processes::Redis;
use crate::replica::Replica;
use bagtrack_testing::within::within;
use reqwest::{Client, Response, StatusCode};

async fn open(client: &Client, replica: &Replica, address: &str) -> Response {
    let clip = Clip::of(0, 1);
    let create = client.post(replica.url(&format!("/sessions?box={}", clip.first_box)));
    let create = create.header("x-forwarded-for", address);
    create.body(clip.frames[0].clone()).send().await.unwrap()
}

#[tokio::test]
#[ignore = "needs redis"]
async fn sessions_that_left_memory_count_in_the_store_for_all_replicas() {
    let redis = Redis::start();
    let flags = ["--max-sessions", "4", "--client-sessions", "6"];
    let flags = [&flags[..], &["--trusted-proxies", "127.0.0.0/8"]].concat();
    let replicas = [0, 1].map(|_| Replica::with_store(&redis.url(), &flags));
    let client = Client::new();
    let mut paths = Vec::new();
    let refused = loop {
        let answer = open(&client, &replicas[paths.len() % 2], "198.51.100.1").await;
        if answer.status() != StatusCode::CREATED {
            break answer;
        }
        paths.push(answer.headers()["location"].to_str().unwrap().to_owned());
        assert!(paths.len() < 50, "nothing bounds the store");
    };
    assert_eq!(
        (paths.len(), refused.status()),
        (6, StatusCode::TOO_MANY_REQUESTS)
    );
    // The text names both limits, since the store does not tell which one is reached.
    let problem: serde_json::Value = refused.json().await.unwrap();
    let detail = problem["detail"].as_str().unwrap();
    assert!(
        detail.contains("6 sessions in the store here, and "),
        "{detail}"
    );
    let other = open(&client, &replicas[0], "203.0.113.1").await;
    assert_eq!(other.status(), StatusCode::CREATED);
    // An ended session frees its place.
    let ended = client
        .delete(replicas[1].url(&paths[0]))
        .send()
        .await
        .unwrap();
    assert_eq!(ended.status(), StatusCode::NO_CONTENT);
    // The replica that has refused asks the store again after a second.
    let again = async {
        loop {
            let answer = open(&client, &replicas[0], "198.51.100.1").await;
            if answer.status() != StatusCode::TOO_MANY_REQUESTS {
                return answer;
            }
        }
    };
    let again = within(again, "the place is given back").await;
    assert_eq!(again.status(), StatusCode::CREATED);
}

/// The text of `/readyz`, which must have status 200.
async fn readiness(client: &Client, replica: &Replica) -> String {
    let answer = client.get(replica.url("/readyz")).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    let ready: serde_json::Value = answer.json().await.unwrap();
    ready["status"].as_str().unwrap().to_owned()
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_store_that_is_nearly_full_takes_frames_and_no_new_session() {
    let redis = Redis::start();
    let replica = Replica::with_store(&redis.url(), &[]);
    let client = Client::new();
    let opened = open(&client, &replica, "198.51.100.1").await;
    let path = opened.headers()["location"].to_str().unwrap().to_owned();
    // Other data takes 4 MiB, so that the free memory below is large compared with Redis's buffers.
    redis.ask(&["setrange", "others", "4194303", "x"]);
    let memory = redis.ask(&["info", "memory"]);
    let used = memory
        .lines()
        .find_map(|line| line.strip_prefix("used_memory:"));
    let used: u64 = used.unwrap().trim().parse().unwrap();
    // About 6 % of the memory is left, enough for many frames.
    redis.ask(&[
        "config",
        "set",
        "maxmemory",
        &(used * 106 / 100).to_string(),
    ]);
    let refused = open(&client, &replica, "198.51.100.1").await;
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    let frames = Clip::of(0, 4).frames;
    for (number, frame) in frames.into_iter().enumerate().skip(1) {
        let post = client.post(replica.url(&format!("{path}/frames?frame={number}")));
        let answer = post.body(frame).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "frame {number}");
    }
    let metrics = client.get(replica.url("/metrics")).send().await.unwrap();
    assert!(
        metrics
            .text()
            .await
            .unwrap()
            .contains("bagtrack_store_full 1")
    );
    // Status 200, because all replicas share the store: with 503, the balancer would have no replica left.
    assert_eq!(readiness(&client, &replica).await, "store-full");
    redis.ask(&["config", "set", "maxmemory", "0"]);
    let opened = open(&client, &replica, "198.51.100.1").await;
    assert_eq!(opened.status(), StatusCode::CREATED);
    assert_eq!(readiness(&client, &replica).await, "ok");
}
