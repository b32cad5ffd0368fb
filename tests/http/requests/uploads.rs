//! While a body arrives, it takes memory for the bytes received so far, and no place in the queue.

use crate::application::{TestApplication, behind_a_proxy, bound_bodies, expect, expect_problem};
use crate::helpers::raw::RawConnection;
use crate::limits::connections::expect_body_timeouts;
use crate::pictures;
use bagtrack_testing::within::within;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use futures_util::stream;
use reqwest::StatusCode;
use serde_json::json;
use std::collections::VecDeque;
use std::io;
use std::time::Duration;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bodies_that_are_announced_and_never_sent_close_the_service_to_nobody() {
    let app = TestApplication::start_with(behind_a_proxy).await;
    let id = app.open().await;
    let mut held = Vec::new();
    // More bodies than places in the queue, which announce more bytes than all uploads may take.
    for client in 1..=5 {
        for which in 0..60 {
            let length = match which % 3 {
                0 => "Transfer-Encoding: chunked",
                1 => "Content-Length: 33554432",
                _ => "Content-Length: 100",
            };
            let lines = format!("X-Forwarded-For: 198.51.100.{client}\r\n{length}");
            let open = RawConnection::hold_with(app.address, "POST", "/sessions", &lines);
            held.push(open.await);
        }
    }
    app.track(&id, 1).await;
    drop(held);
}

#[tokio::test]
async fn the_bodies_of_all_requests_together_are_bounded_by_what_has_arrived() {
    let app = TestApplication::start_with(|config| {
        config.max_body_bytes = 50_000;
        config.max_upload_bytes = 100_000;
        config.limits.client_upload_bytes = Some(200_000);
    });
    let app = app.await;
    let (id, other, third) = (app.open().await, app.open().await, app.open().await);
    let target = format!("/sessions/{other}/frames");
    let post = || app.post_frame(&id, pictures::png(1));
    let mut held = RawConnection::hold(app.address, "POST", &target, 49_000).await;
    let target = format!("/sessions/{third}/frames");
    let mut more = RawConnection::hold(app.address, "POST", &target, 49_000).await;
    expect(post().await, StatusCode::OK).await;
    held.send([7; 48_000]).await;
    more.send([7; 48_000]).await;
    let full = async { while post().await.status() == StatusCode::OK {} };
    within(full, "what has arrived is counted").await;
    expect_problem(post().await, "queue-full").await;
    drop((held, more));
    let freed = async { while post().await.status() != StatusCode::OK {} };
    within(freed, "what has gone is not").await;
}

#[tokio::test]
async fn json_counts_with_the_copies_that_parsing_makes() {
    let app = TestApplication::start_with(|config| bound_bodies(config, 100_000, 150_000)).await;
    let id = app.open().await;
    let mut padded = pictures::png(1);
    padded.resize(45_000, 0);
    let text = BASE64_STANDARD.encode(&padded);
    let post = || app.frames_request(&id, &[]);
    let response = post().json(&json!({ "frame": text })).send().await.unwrap();
    expect_problem(response, "quota-exceeded").await;
    let response = post().body(padded).send().await.unwrap();
    expect(response, StatusCode::OK).await;
}

/// For example a video over a usual line.
#[tokio::test]
async fn a_large_body_that_comes_steadily_has_more_time_than_a_small_one() {
    const PIECE: usize = 64 << 10;
    let app = TestApplication::start_with(|config| config.body_timeout = Duration::from_secs(1));
    let app = app.await;
    let id = app.open().await;
    let mut padded = pictures::png(1);
    padded.resize(10 * PIECE, 0);
    let pieces = padded.chunks(PIECE).map(<[u8]>::to_vec);
    let clock = tokio::time::interval(Duration::from_millis(250));
    let line = stream::unfold(
        (clock, pieces.collect::<VecDeque<_>>()),
        |(mut clock, mut left)| async {
            clock.tick().await;
            let piece = left.pop_front()?;
            Some((Ok::<_, io::Error>(piece), (clock, left)))
        },
    );
    let body = reqwest::Body::wrap_stream(line);
    let answer = app.frames_request(&id, &[]).body(body).send().await;
    expect(answer.unwrap(), StatusCode::OK).await;
}

/// A service with a high least rate of bodies, and a long time for a whole body: both limits end with the same answer,
/// and only the first one is to be tested.
async fn with_a_high_least_rate() -> TestApplication {
    let app = TestApplication::start_with(|config| {
        config.body_timeout = Duration::from_secs(600);
        config.limits.body_grace = Duration::from_millis(50);
        config.limits.min_body_rate = 1_000_000;
    });
    app.await
}

#[tokio::test]
async fn a_body_slower_than_the_least_rate_is_408_in_every_form() {
    let app = with_a_high_least_rate().await;
    let id = app.open().await;
    let timeouts = expect_body_timeouts(&app, &id);
    tokio::time::timeout(Duration::from_secs(30), timeouts)
        .await
        .expect("each ends by its rate, within a moment");
    assert_eq!(app.frames_of(&id).await, 1);
}

/// Reading the rest of a refused body must not last until the deadline of the largest body.
#[tokio::test]
async fn the_rest_of_a_refused_body_has_the_same_least_rate() {
    let app = with_a_high_least_rate().await;
    let mut connection = RawConnection::open(app.address).await;
    let head = "POST /sessions/none/frames HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000000\r\n\r\nbegun";
    connection.send(head).await;
    let answer = tokio::time::timeout(Duration::from_secs(30), connection.read_to_end());
    let answer = answer.await.expect("the connection ends within a moment");
    assert!(answer.starts_with("HTTP/1.1 404"), "{answer}");
}

#[tokio::test]
async fn a_length_over_the_limit_is_refused_before_the_body_is_sent() {
    let (app, id) = TestApplication::with_session().await;
    let mut connection = RawConnection::open(app.address).await;
    let head = format!(
        "POST /sessions/{id}/frames HTTP/1.1\r\nHost: localhost\r\nContent-Length: 629145600\r\n\r\n"
    );
    connection.send(head).await;
    let answer = connection.read_answer().await;
    assert!(answer.starts_with("HTTP/1.1 413"), "{answer}");
    assert!(answer.contains("/docs/problems#body-too-large"), "{answer}");
}
