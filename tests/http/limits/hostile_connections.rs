//! Clients that hold connections, close one side of them, or do not speak HTTP.

use crate::application::{TestApplication, expect};
use crate::helpers::heavy;
use crate::helpers::raw::RawConnection;
use crate::pictures;
use bagtrack_testing::within::within;
use futures_util::future::join_all;
use reqwest::StatusCode;
use std::time::Duration;

const HEALTH: &str = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";

#[tokio::test]
async fn clients_that_never_read_lose_their_connections() {
    let app = TestApplication::start_with(|config| {
        config.max_connections = 7;
        config.limits.client_connections = Some(7);
        config.limits.write_timeout = Duration::from_millis(100);
    });
    let app = app.await;
    let id = app.open().await;
    let ask = "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(50);
    // Sends without end, and never reads; sending fails when the service has closed the connection.
    let never_reads = async || {
        let mut connection = RawConnection::open(app.address).await;
        while connection.try_send(&ask).await.is_ok() {}
    };
    let refused = join_all((0..6).map(|_| never_reads()));
    let other = async {
        app.track(&id, 1).await;
    };
    let both = async { tokio::join!(refused, other) };
    within(both, "the connections end").await;
    expect(app.get("/healthz").await, StatusCode::OK).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_reads_too_slowly_loses_its_connection() {
    let app = TestApplication::start_with(|config| {
        config.limits.write_timeout = Duration::from_secs(1);
        config.limits.min_answer_rate = 1_000_000_000;
    });
    let app = app.await;
    let connection = RawConnection::open(app.address).await;
    let ask = "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(20_000);
    // Reads more slowly than the answers would come.
    let trickle = connection.trickle(ask, 64 << 10, Duration::from_millis(20));
    let read = within(trickle, "the connection ends").await;
    assert!(
        read > 1 << 20,
        "it was ended for reading nothing: {read} bytes"
    );
    expect(app.get("/healthz").await, StatusCode::OK).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_reads_slowly_but_steadily_gets_all_of_its_answers() {
    let app = TestApplication::start_with(|config| {
        config.limits.write_timeout = Duration::from_secs(1);
        config.limits.min_answer_rate = 64 << 10;
    });
    let app = app.await;
    let length = app.get("/openapi.json").await.bytes().await.unwrap().len();
    // More answers than the socket buffers of both sides hold.
    let count = (6 << 20) / length;
    let ask = "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n";
    let asks = [
        format!("{ask}\r\n").repeat(count),
        format!("{ask}Connection: close\r\n\r\n"),
    ];
    let connection = RawConnection::open(app.address).await;
    // Some 600 KB a second, nine times the least rate.
    let trickle = connection.trickle(asks.concat(), 16 << 10, Duration::from_millis(25));
    let read = within(trickle, "the answers come").await;
    assert!(read > (count + 1) * length, "{read} of {count} * {length}");
}

#[tokio::test]
async fn when_all_connections_are_taken_an_idle_one_makes_room() {
    let app = TestApplication::start_with(|config| {
        config.max_connections = 3;
        config.limits.client_connections = Some(9);
    });
    let app = app.await;
    let mut silent = Vec::new();
    for _ in 0..3 {
        silent.push(RawConnection::open(app.address).await);
    }
    for _ in 0..3 {
        let mut connection = RawConnection::open(app.address).await;
        connection.send(HEALTH).await;
        let answer = connection.read_answer().await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        silent.push(connection);
    }
    // The three oldest connections were closed to make room.
    for connection in &mut silent[..3] {
        assert_eq!(connection.read_to_end().await, "");
    }
    // A flood of connections makes room for itself, too.
    for _ in 0..50 {
        for _ in 0..5 {
            silent.push(RawConnection::open(app.address).await);
        }
        let mut connection = RawConnection::open(app.address).await;
        connection.send(HEALTH).await;
        let answer = connection.read_answer().await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
}

#[tokio::test]
async fn a_half_closed_connection_gets_its_answer() {
    let app = TestApplication::start().await;
    let session = heavy::open(&app).await;
    let request = heavy::post(&app, &session, 10);
    let mut client = heavy::send_raw(&app, &format!("{session}/frames"), request).await;
    client.close_sending().await;
    let answer = client.read_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    for frame in 1..=10 {
        assert!(answer.contains(&format!("\"frame\":{frame},")), "{answer}");
    }

    let id = app.open().await;
    let mut client = RawConnection::open(app.address).await;
    let frame = pictures::png(1);
    let head = format!(
        "POST /sessions/{id}/frames HTTP/1.1\r\nHost: localhost\r\nContent-Length: {}\r\n\r\n",
        frame.len() + 1
    );
    client.send(head).await;
    client.send(frame).await;
    client.close_sending().await;
    // The last byte of the request never comes.
    let answer = client.read_to_end().await;
    assert!(!answer.contains("HTTP/1.1 200"), "{answer}");
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_head_that_is_not_http_gets_its_status_and_the_connection_ends() {
    let app = TestApplication::start().await;
    let long = "a".repeat(200_000);
    for (head, status) in [
        ("NONSENSE\r\n\r\n".to_owned(), "400"),
        (
            "GET / HTTP/1.1\r\nHost: localhost\r\nbad header: x\r\n\r\n".to_owned(),
            "400",
        ),
        (
            "POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nab".to_owned(),
            "400",
        ),
        (
            format!("GET / HTTP/1.1\r\nHost: localhost\r\nx: {long}\r\n\r\n"),
            "431",
        ),
    ] {
        let mut client = RawConnection::open(app.address).await;
        // Sending may fail: the service may close the connection with part of a long head unread.
        let _ = client.try_send(&head).await;
        let answer = client.read_to_end().await;
        let is_right = answer.starts_with(&format!("HTTP/1.1 {status}"));
        assert!(is_right, "{answer}");
    }
}

#[tokio::test]
async fn a_request_names_exactly_one_host() {
    let app = TestApplication::start().await;
    for (hosts, status) in [
        ("", "400"),
        ("Host: a\r\nHost: b\r\n", "400"),
        ("Host: a\r\nHost: a\r\n", "400"),
        ("Host: a\r\n", "200"),
    ] {
        let mut client = RawConnection::open(app.address).await;
        client
            .send(format!("GET /healthz HTTP/1.1\r\n{hosts}\r\n"))
            .await;
        let answer = client.read_answer().await;
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status}")),
            "{hosts:?}: {answer}"
        );
        let is_problem = answer.contains("/docs/problems#malformed-request");
        assert_eq!(is_problem, status == "400", "{answer}");
    }
    let mut old = RawConnection::open(app.address).await;
    old.send("GET /healthz HTTP/1.0\r\n\r\n").await;
    let answer = old.read_to_end().await;
    assert!(answer.starts_with("HTTP/1.0 200"), "{answer}");
}

#[tokio::test]
async fn what_stands_before_the_first_part_of_a_form_and_the_heads_of_parts_are_bounded() {
    let (app, id) = TestApplication::with_session().await;
    let path = format!("/sessions/{id}/frames");
    let lines = "Content-Type: multipart/form-data; boundary=b\r\nContent-Length: 8000000";
    let head = "--b\r\nContent-Disposition: form-data; name=\"frame\"\r\nX: ";
    for begin in ["", head] {
        let mut client = RawConnection::hold_with(app.address, "POST", &path, lines).await;
        client.send(begin).await;
        // Many small pieces, without the end of the body: the parser must not search all earlier pieces again for each.
        for _ in 0..5 {
            client.send("x".repeat(4_096)).await;
        }
        let answer = client.read_answer().await;
        assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
        assert!(answer.contains("16384 bytes"), "{answer}");
    }
    // Pieces of any size make a whole form.
    let body = [
        b"before\r\n--b\r\nContent-Disposition: form-data; name=\"frame\"\r\n\r\n".to_vec(),
        pictures::png(1),
        b"\r\n--b--\r\nbehind".to_vec(),
    ]
    .concat();
    let length = body.len();
    let lines =
        format!("Content-Type: multipart/form-data; boundary=b\r\nContent-Length: {length}");
    let mut client = RawConnection::hold_with(app.address, "POST", &path, &lines).await;
    for piece in body.chunks(7) {
        client.send(piece).await;
    }
    let answer = client.read_answer().await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
}
