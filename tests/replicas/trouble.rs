//! The configurations of docker/ with replicas that are about to end, or whose store is out of reach; and streams.

use crate::balancers::{Balancer, haproxy, nginx};
use crate::clip::Clip;
use crate::pair::{Pair, json};
use crate::replica::Replica;
use crate::stream_client::StreamClient;
use reqwest::{Client, Response, StatusCode};
use std::time::Instant;

async fn open(client: &Client, front: &Balancer, clip: &Clip) -> Response {
    let url = format!("http://{}/sessions?box={}", front.address, clip.first_box);
    let request = client.post(url).body(clip.frames[0].clone());
    request.send().await.unwrap()
}

fn location(opened: &Response) -> String {
    let location = opened.headers().get("location");
    let location = location.unwrap_or_else(|| panic!("{opened:?}"));
    location.to_str().unwrap().to_owned()
}

/// Without a store, a request that went to another replica would not find its session.
#[tokio::test]
#[ignore = "needs haproxy"]
async fn haproxy_sends_a_replica_that_is_about_to_end_the_frames_of_its_sessions_and_no_new_ones() {
    let replicas = [(); 3].map(|()| Replica::start(&["--shutdown-delay", "60s"]));
    let front = haproxy(&replicas.each_ref().map(|replica| replica.address));
    let (client, clip) = (Client::new(), Clip::of(0, 60));
    let session = location(&open(&client, &front, &clip).await);
    let mut own = None;
    for replica in &replicas {
        let view = client.get(replica.url(&session)).send().await.unwrap();
        if view.status() == StatusCode::OK {
            own = Some(replica);
        }
    }
    let own = own.expect("a replica has the session");
    own.ask_to_end();
    while own.readiness().await == StatusCode::OK {}
    // Until HAProxy has noticed that the replica drains, it sends it some new sessions, which are refused. It has when
    // this number of sessions in a row are opened by the others.
    const ALL: usize = 16;
    let (asked, mut number, mut opened) = (Instant::now(), 0, 0);
    while opened < ALL {
        assert!(asked.elapsed().as_secs() < 60, "it gets new ones");
        number += 1;
        let frame = clip.frames[number % 60].clone();
        let url = format!("http://{}{session}/frames?frame={number}", front.address);
        let answer = client.post(url).body(frame).send().await.unwrap();
        assert_eq!(answer.headers()["draining"], "true");
        json(answer, StatusCode::OK).await;
        let new = open(&client, &front, &clip).await;
        opened = match new.status() {
            StatusCode::CREATED => opened + 1,
            _ => 0,
        };
    }
    // Longer than HAProxy would need to consider the replica dead.
    while asked.elapsed().as_secs() < 5 {
        number += 1;
        let frame = clip.frames[number % 60].clone();
        let url = format!("http://{}{session}/frames?frame={number}", front.address);
        let answer = client.post(url).body(frame).send().await.unwrap();
        json(answer, StatusCode::OK).await;
    }
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn behind_haproxy_a_store_that_is_away_is_told_by_problem_documents() {
    let mut pair = Pair::open(&["--store-timeout", "2s"], 4).await;
    let front = haproxy(&pair.replicas.each_ref().map(|replica| replica.address));
    let url = |path: &str| format!("http://{}/sessions{path}", front.address);
    let post = async |number: usize| {
        let url = url(&format!("/{}/frames?frame={number}", pair.id));
        let request = pair.client.post(url).body(pair.clip.frames[number].clone());
        request.send().await.unwrap()
    };
    json(post(1).await, StatusCode::OK).await;
    pair.redis.stop();
    for replica in &pair.replicas {
        while replica.readiness().await == StatusCode::OK {}
    }
    let is_problem = async |answer: Response, kind: &str| {
        assert!(answer.headers().contains_key("retry-after"));
        let media_type = answer.headers()["content-type"].to_str().unwrap();
        assert_eq!(media_type, "application/problem+json");
        let problem = json(answer, StatusCode::SERVICE_UNAVAILABLE).await;
        problem["type"] == format!("/docs/problems#{kind}")
    };
    let stopped = Instant::now();
    loop {
        assert!(is_problem(post(2).await, "store-unavailable").await);
        // The answer of a replica, until HAProxy has noticed that no replica accepts new sessions.
        let new = open(&pair.client, &front, &pair.clip).await;
        if is_problem(new, "not-ready").await {
            break;
        }
        assert!(
            stopped.elapsed().as_secs() < 60,
            "HAProxy does not find out"
        );
    }
    // Longer than HAProxy would need to consider the replicas dead.
    let told = Instant::now();
    while told.elapsed().as_secs() < 4 {
        assert!(is_problem(post(2).await, "store-unavailable").await);
    }
    pair.redis.start_again();
    while post(2).await.status() != StatusCode::OK {}
    while open(&pair.client, &front, &pair.clip).await.status() != StatusCode::CREATED {}
}

/// Tracks frames over a stream through a balancer, and goes on over a second stream, beginning with a stored answer.
async fn a_stream_passes(balance: fn(&[std::net::SocketAddr]) -> Balancer) {
    let pair = Pair::open(&[], 12).await;
    let expected = pair.undisturbed().await;
    let [first, second] = pair.replicas.each_ref().map(|replica| replica.address);
    let front = balance(&[first, second, first]);
    let mut stream = StreamClient::open_in_time(front.address, pair.id, "").await;
    for number in 1..10 {
        let answer = stream.track(&pair.clip.frames[number]).await;
        assert_eq!(answer["box"], expected[number - 1]["box"]);
        assert_eq!(answer["checkpoint"], number);
    }
    let mut again = StreamClient::open_in_time(front.address, pair.id, "?from=9").await;
    assert_eq!(again.message().await["frame"], 9);
    let answer = again.track(&pair.clip.frames[10]).await;
    assert_eq!(answer["box"], expected[9]["box"]);
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_stream_passes_through_haproxy() {
    a_stream_passes(haproxy).await;
}

#[tokio::test]
#[ignore = "needs redis and nginx"]
async fn a_stream_passes_through_nginx() {
    a_stream_passes(nginx).await;
}
