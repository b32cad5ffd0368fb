//! Metrics of lines, of messages, and of connections that no handler sees; and readiness.

use crate::application::{TestApplication, bound_bodies, expect, expect_detail};
use crate::helpers::raw::RawConnection;
use crate::operation::metrics::{metrics, readiness, value};
use crate::pictures;
use crate::requests::forms::form;
use crate::stream_client::StreamClient;
use bagtrack_testing::within::within;
use futures_util::future::join_all;
use reqwest::{Method, StatusCode};
use serde_json::Value;
use std::time::Duration;

#[tokio::test]
async fn lines_and_messages_count_as_sent() {
    let (app, id) = TestApplication::with_session().await;
    let sent = async || value(&metrics(&app).await, "bagtrack_sent_bytes_total", &[]);
    let frames = form((1..=60).map(|t| pictures::png(t % 20)));
    // Between two readings of the metrics, only the answer with the first reading is added.
    let own = metrics(&app).await.len();
    let before = sent().await;
    let request = app.frames_request(&id, &[]);
    let request = request.header("accept", "application/x-ndjson");
    let answer = request.multipart(frames).send().await.unwrap();
    let lines = answer.text().await.unwrap().len();
    let all = sent().await - before;
    assert!(
        all >= (lines + own / 2) as f64 && lines > 2 * own / 3,
        "{all} {lines} {own}"
    );
    let mut stream = StreamClient::open(app.address, &id, "").await;
    let before = sent().await;
    let mut messages = 0;
    for t in 2..400 {
        stream.send(pictures::png(t % 20)).await;
        messages += stream.message().await.to_string().len();
    }
    let all = sent().await - before;
    assert!(all > messages as f64, "{all} {messages}");
}

#[tokio::test]
async fn an_address_has_a_share_of_the_connections_and_what_ends_before_a_handler_is_counted() {
    let app = TestApplication::start_with(|config| {
        config.max_connections = 4;
        config.limits.client_connections = Some(2);
        // Long enough that, on a slow machine too, a busy connection stays busy until the end of the test.
        config.body_timeout = Duration::from_secs(600);
        config.limits.body_grace = Duration::from_secs(600);
    });
    let app = app.await;
    let mut busy = Vec::new();
    for _ in 0..2 {
        busy.push(RawConnection::hold(app.address, "POST", "/sessions", 1000).await);
    }
    // Kubernetes restarts a service that does not answer probes; they may come from an address that clients share.
    for probe in ["/healthz", "/readyz"] {
        expect(app.get(probe).await, StatusCode::OK).await;
    }
    let mut refused = RawConnection::open(app.address).await;
    refused
        .send("POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n")
        .await;
    expect_refusal(&refused.read_to_end().await);
    // A few connections without a request may stay, and make room for others.
    let mut silent = Vec::new();
    for _ in 0..40 {
        silent.push(RawConnection::open(app.address).await);
    }
    expect(app.get("/healthz").await, StatusCode::OK).await;
    let answers = join_all(silent.iter_mut().map(RawConnection::read_to_end)).await;
    assert!(answers.iter().all(String::is_empty), "{answers:?}");
    drop(busy.pop());
    // The open ones are two idle connections, the first of which makes room, and this client's own.
    let counted = async {
        loop {
            let _idle = RawConnection::open(app.address).await;
            let Ok(response) = app.request(Method::GET, "/metrics", &[]).send().await else {
                continue;
            };
            if response.status() != StatusCode::OK {
                continue;
            }
            let text = response.text().await.unwrap();
            let problems = |kind: &str| value(&text, "bagtrack_problems_total", &[kind]);
            if value(&text, "bagtrack_connections_shed_total", &[]) >= 1.0 {
                break problems("kind=\"quota-exceeded\"");
            }
        }
    };
    let refused = within(counted, "the count is told").await;
    assert!(refused >= 1.0, "{refused}");
}

/// Checks that this is the answer to a connection beyond the share of its address.
#[track_caller]
fn expect_refusal(answer: &str) {
    assert!(answer.starts_with("HTTP/1.1 429"), "{answer}");
    let (head, body) = answer.split_once("\r\n\r\n").expect("an answer");
    let problem: Value = serde_json::from_str(body).unwrap();
    assert_eq!(problem["type"], "/docs/problems#quota-exceeded");
    for header in [
        "retry-after: 1",
        "connection: close",
        "x-content-type-options: nosniff",
        "content-security-policy: ",
        "x-frame-options: DENY",
    ] {
        assert!(head.contains(header), "{header}: {head}");
    }
}

#[tokio::test]
async fn readiness_ends_when_the_memory_of_bodies_is_used_up() {
    let app = TestApplication::start_with(|config| bound_bodies(config, 100_000, 100_000)).await;
    let id = app.open().await;
    let target = format!("/sessions/{id}/frames");
    let mut held = RawConnection::hold(app.address, "POST", &target, 99_000).await;
    expect(app.get("/readyz").await, StatusCode::OK).await;
    held.send([7; 98_000]).await;
    let full = readiness(&app, StatusCode::SERVICE_UNAVAILABLE).await;
    expect_detail(full, "not-ready", &["bodies"]).await;
    drop(held);
    readiness(&app, StatusCode::OK).await;
}
