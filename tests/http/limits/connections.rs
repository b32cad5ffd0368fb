//! Slow clients, large bodies, and the end of the service.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::helpers::raw::RawConnection;
use crate::operation::metrics::readiness;
use crate::pictures;
use crate::requests::forms::form;
use bagtrack_testing::within::within;
use reqwest::{Method, StatusCode};
use serde_json::json;
use std::time::Duration;

const SHORT: Duration = Duration::from_millis(100);

#[tokio::test]
async fn a_head_that_never_ends_closes_the_connection() {
    let app = TestApplication::start_with(|config| config.header_timeout = SHORT).await;
    let mut connection = RawConnection::open(app.address).await;
    connection.send("GET /healthz HTTP/1.1\r\nHost: te").await;
    let answer = connection.read_to_end().await;
    assert!(!answer.contains("200"), "{answer}");
}

#[tokio::test]
async fn an_idle_connection_is_closed() {
    let app = TestApplication::start_with(|config| config.header_timeout = SHORT).await;
    let mut connection = RawConnection::open(app.address).await;
    assert_eq!(connection.read_to_end().await, "");
    // On a busy machine, a connection may be idle for too long before it asks: then it tries again.
    let asked = async {
        loop {
            let mut connection = RawConnection::open(app.address).await;
            let ask = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";
            if connection.try_send(ask).await.is_ok() {
                let answer = connection.read_to_end().await;
                if !answer.is_empty() {
                    break answer;
                }
            }
        }
    };
    let answer = within(asked, "one is answered").await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
}

/// Begins a body in each form and sends no more of it.
pub async fn expect_body_timeouts(app: &TestApplication, id: &str) {
    for media_type in [
        "image/jpeg",
        "application/json",
        "multipart/form-data; boundary=b",
    ] {
        let mut connection = RawConnection::open(app.address).await;
        let head = format!(
            "POST /sessions/{id}/frames HTTP/1.1\r\nHost: localhost\r\nContent-Type: {media_type}\r\n\
             Content-Length: 9000000\r\nConnection: close\r\n\r\n--b\r\n"
        );
        connection.send(head).await;
        let answer = connection.read_answer().await;
        assert!(answer.starts_with("HTTP/1.1 408"), "{media_type}: {answer}");
        assert!(answer.contains("/docs/problems#body-timeout"), "{answer}");
    }
}

#[tokio::test]
async fn a_body_that_never_ends_is_408_in_every_form() {
    let app = TestApplication::start_with(|config| config.body_timeout = SHORT).await;
    let id = app.open().await;
    expect_body_timeouts(&app, &id).await;
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_body_that_is_too_large_is_413_in_every_form() {
    let app = TestApplication::start_with(|config| config.max_body_bytes = 100_000).await;
    let id = app.open().await;
    let large = || vec![b'A'; 3_000_000];
    let request = || app.frames_request(&id, &[]);
    let form = form([large()]);
    let text = String::from_utf8(large()).unwrap();
    let endless = futures_util::stream::repeat_with(|| Ok::<_, std::io::Error>(vec![0; 10_000]));
    let endless = futures_util::StreamExt::take(endless, 15);
    for (form, request) in [
        ("raw", request().body(large())),
        ("multipart", request().multipart(form)),
        ("JSON", request().json(&json!({ "frame": text }))),
        (
            "chunked",
            request().body(reqwest::Body::wrap_stream(endless)),
        ),
    ] {
        let response = request
            .send()
            .await
            .unwrap_or_else(|error| panic!("{form}: {error:?}"));
        expect_problem(response, "body-too-large").await;
    }
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_refused_body_is_taken_in_so_that_the_client_reads_why() {
    let app = TestApplication::start().await;
    for _ in 0..5 {
        let response = app.post_frame("no-session", vec![0; 20_000_000]).await;
        expect_problem(response, "session-not-found").await;
    }
}

#[tokio::test]
async fn a_path_or_method_that_is_not_there_is_a_problem() {
    let app = TestApplication::start().await;
    expect_problem(app.get("/session").await, "route-not-found").await;
    expect_problem(app.get("/sessions/a/b/c").await, "route-not-found").await;
    expect_problem(app.get("/docs/%FF").await, "route-not-found").await;
    expect_problem(app.get("/sessions/%FF").await, "session-not-found").await;
    for (method, path, allowed) in [
        (Method::GET, "/sessions", "POST"),
        (Method::PATCH, "/sessions/a", "GET,HEAD,DELETE,PUT"),
        (Method::POST, "/openapi.json", "GET,HEAD"),
    ] {
        let response = app.request(method, path, &[]).send().await.unwrap();
        assert_eq!(response.headers()["allow"], allowed);
        let problem = expect_problem(response, "method-not-allowed").await;
        assert_eq!(problem["status"], 405);
    }
}

#[tokio::test]
async fn a_panic_is_a_problem_and_the_service_goes_on() {
    let app = TestApplication::start().await;
    let problem = expect_problem(app.get("/panic").await, "internal").await;
    assert!(!problem.to_string().contains("a test panics"));
    expect(app.get("/healthz").await, StatusCode::OK).await;
}

#[tokio::test]
async fn an_open_request_ends_before_the_service_does() {
    let mut app = TestApplication::start().await;
    let id = app.open().await;
    let frame = pictures::png(1);
    let target = format!("/sessions/{id}/frames");
    let mut held = RawConnection::hold(app.address, "POST", &target, frame.len()).await;
    let silent = RawConnection::open(app.address).await;
    app.shut_down();
    let refused = async { while tokio::net::TcpStream::connect(app.address).await.is_ok() {} };
    within(refused, "it listens no more").await;
    held.send(&frame).await;
    let answer = held.read_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    // A client that only holds a connection does not delay the end either.
    assert!(app.ended().await);
    drop(silent);
}

#[tokio::test]
async fn the_end_is_not_held_up_by_a_client_that_never_ends() {
    let app = TestApplication::start_with(|config| config.shutdown_timeout = SHORT);
    let mut app = app.await;
    let id = app.open().await;
    let target = format!("/sessions/{id}/frames");
    let mut held = RawConnection::hold(app.address, "POST", &target, 1000).await;
    app.shut_down();
    assert!(!app.ended().await);
    assert_eq!(held.read_to_end().await, "");
}

#[tokio::test]
async fn readiness_ends_before_the_service_does() {
    let app =
        TestApplication::start_with(|config| config.shutdown_delay = Duration::from_secs(600));
    let mut app = app.await;
    let id = app.open().await;
    let before = app.post_frame(&id, pictures::png(1)).await;
    assert!(!before.headers().contains_key("draining"));
    app.shut_down();
    let not_ready = readiness(&app, StatusCode::SERVICE_UNAVAILABLE).await;
    expect_problem(not_ready, "not-ready").await;
    expect(app.get("/healthz").await, StatusCode::OK).await;
    // Until connections are refused, the service answers sessions, and `Draining` tells their clients to go elsewhere.
    let answer = app.post_frame(&id, pictures::png(1)).await;
    assert_eq!(answer.headers()["draining"], "true");
    expect(answer, StatusCode::OK).await;
    let refused = app.create(pictures::png(0), &[("box", BOX)]).await;
    assert_eq!(refused.headers()["draining"], "true");
    expect_problem(refused, "not-ready").await;
    assert!(!app.snapshot(&id).await.is_empty());
}

#[tokio::test]
async fn nobody_keeps_the_places_for_probes() {
    let app = TestApplication::start_with(|config| config.limits.client_connections = Some(1));
    let app = app.await;
    let id = app.open().await;
    let target = format!("/sessions/{id}/frames");
    let _busy = RawConnection::hold(app.address, "POST", &target, 1_000).await;
    // Silent connections are closed to make room for the probes; a probe's connection is closed after its answer.
    let mut silent = Vec::new();
    for _ in 0..20 {
        silent.push(RawConnection::open(app.address).await);
    }
    for _ in 0..20 {
        let mut probe = RawConnection::open(app.address).await;
        probe
            .send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            .await;
        let answer = within(probe.read_to_end(), "it is closed").await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
}
