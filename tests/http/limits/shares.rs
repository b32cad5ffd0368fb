//! What one client may hold, and that others get theirs beside it.

use crate::application::{
    BOX, TestApplication, behind_a_proxy, expect, expect_detail, expect_problem,
};
use crate::helpers::heavy;
use crate::helpers::raw::RawConnection;
use crate::operation::metrics::{metrics, value};
use crate::pictures;
use crate::requests::lines::LINES;
use crate::stream_client::{Received, StreamClient};
use bagtrack::http::{Config, Secret};
use bagtrack_testing::within::within;
use reqwest::multipart::{Form, Part};
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use std::convert::Infallible;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::Notify;

const GREEDY: &str = "198.51.100.1";
const MODEST: &str = "203.0.113.1";

/// A request of the client at this address.
fn request_as(
    app: &TestApplication,
    client: &str,
    path: &str,
    query: &[(&str, &str)],
) -> RequestBuilder {
    let request = app.request(Method::POST, path, query);
    request.header("x-forwarded-for", client)
}

async fn open_dear(app: &TestApplication, client: &str) -> Response {
    let query = [
        ("box", BOX),
        ("preset", "paper"),
        ("parameters", heavy::PARAMS),
    ];
    let request = request_as(app, client, "/sessions", &query);
    request.body(pictures::png(0)).send().await.unwrap()
}

async fn open(app: &TestApplication, client: &str) -> String {
    let opened = expect(app.create_as(client).await, StatusCode::CREATED).await;
    opened["id"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn one_client_with_costly_sessions_leaves_memory_for_those_of_others() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.limits.max_session_bytes = Some(64 << 20);
    });
    let app = app.await;
    let (opened, refused) = open_all(&app, GREEDY).await;
    // One client must not get the memory of all sessions, and leave others 503.
    expect_detail(refused, "quota-exceeded", &["bytes of sessions"]).await;
    assert!(opened >= 2, "{opened}");
    expect(open_dear(&app, MODEST).await, StatusCode::CREATED).await;
    let id = open(&app, MODEST).await;
    app.track(&id, 1).await;
}

/// Opens expensive sessions as this client until one is refused. Returns their number, and the refusal.
async fn open_all(app: &TestApplication, client: &str) -> (usize, Response) {
    let mut opened = 0;
    loop {
        let answer = open_dear(app, client).await;
        if answer.status() != StatusCode::CREATED {
            return (opened, answer);
        }
        opened += 1;
    }
}

#[tokio::test]
async fn the_share_of_sessions_shrinks_with_each_client_and_the_next_one_still_opens_some() {
    // With the defaults, the memory does not suffice for as many expensive sessions as are allowed.
    let app = TestApplication::start_with(behind_a_proxy).await;
    let mut shares = Vec::new();
    for client in 1..=6 {
        let (opened, refused) = open_all(&app, &format!("198.51.100.{client}")).await;
        // Three clients get a quarter of the memory each, later ones half of what is left.
        let slug = match client {
            1..=3 => "quota-exceeded",
            _ => "too-many-sessions",
        };
        expect_problem(refused, slug).await;
        shares.push(opened);
    }
    println!("{shares:?}");
    assert_eq!(shares[0], shares[1]);
    assert_eq!(shares[0], shares[2]);
    assert!(shares[3] < shares[2], "{shares:?}");
    for (before, after) in shares[3..].iter().zip(&shares[4..]) {
        assert!(*after >= 1 && after * 2 <= before + 1, "{shares:?}");
    }
    expect(open_dear(&app, MODEST).await, StatusCode::CREATED).await;
    let id = open(&app, MODEST).await;
    app.track(&id, 1).await;
}

/// Bytes of a body that a client holds open, and of the memory for all uploads.
const HELD: usize = 1 << 20;
const UPLOADS: usize = 8 * HELD;

async fn small_uploads() -> TestApplication {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.max_body_bytes = HELD;
        config.max_upload_bytes = UPLOADS;
        config.body_timeout = Duration::from_secs(20);
    });
    app.await
}

async fn upload_bytes(app: &TestApplication) -> usize {
    value(&metrics(app).await, "bagtrack_upload_bytes", &[]) as usize
}

/// Sends a body without its last byte. Returns the connection, which keeps the body's memory taken; `None` if the
/// service refuses the body.
async fn hold_body(app: &TestApplication, client: &str) -> Option<RawConnection> {
    hold_body_with(app, "/sessions", &format!("X-Forwarded-For: {client}")).await
}

/// Like [`hold_body`], for a post to this path with this header line.
async fn hold_body_with(app: &TestApplication, path: &str, line: &str) -> Option<RawConnection> {
    let before = upload_bytes(app).await;
    let lines = format!("{line}\r\nContent-Length: {HELD}");
    let mut body = RawConnection::hold_with(app.address, "POST", path, &lines).await;
    // Sending may fail: the service may refuse the body before all of it has come.
    let _ = body.try_send(vec![7; HELD - 1]).await;
    loop {
        tokio::select! {
            answer = body.read_answer() => {
                assert!(answer.starts_with("HTTP/1.1 503") || answer.starts_with("HTTP/1.1 429"), "{answer}");
                return None;
            }
            held = upload_bytes(app) => if held >= before + HELD {
                return Some(body);
            },
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_addresses_of_one_network_hold_half_of_the_memory_for_bodies_and_others_upload() {
    for network in [
        // Addresses with the first 64, 56 and 48 bits in common.
        |client: u16| format!("2001:db8:1:2::{client:x}"),
        |client: u16| format!("2001:db8:1:{client:x}::1"),
        |client: u16| format!("2001:db8:1:{client:x}00::1"),
    ] {
        let app = small_uploads().await;
        let mut held = Vec::new();
        for client in 1..=6 {
            held.extend(hold_body(&app, &network(client)).await);
        }
        // One client (a network of 64 bits) may hold a quarter of the memory; a larger network, half of it.
        let of_one_client = network(1).split("::").next() == network(2).split("::").next();
        let most = if of_one_client { 2 } else { 4 };
        assert_eq!(held.len(), most, "{}", network(1));
        let mut picture = pictures::png(0);
        picture.resize(HELD, 0);
        for other in [MODEST, "2001:db8:2::1"] {
            let request = request_as(&app, other, "/sessions", &[("box", BOX)]);
            let opened = request.body(picture.clone()).send().await.unwrap();
            expect(opened, StatusCode::CREATED).await;
        }
        drop(held);
        let freed = async { while upload_bytes(&app).await > 0 {} };
        within(freed, "all is given back").await;
    }
}

/// A service with one key, two sessions of that key, and the authorization header of a page that has a token for the
/// first session.
async fn beside_a_page(change: fn(&mut Config)) -> (TestApplication, [String; 2], String) {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.access.api_keys = vec![Secret::from("me:0123456789abcdef")];
        change(config);
    });
    let app = app.await;
    let sessions = [app.open().await, app.open().await];
    let line = format!("Authorization: Bearer {}", app.token(&sessions[0]).await);
    (app, sessions, line)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stalled_bodies_of_a_page_leave_memory_to_the_other_sessions_of_its_key() {
    let (app, sessions, line) = beside_a_page(|config| {
        config.max_body_bytes = HELD;
        config.max_upload_bytes = UPLOADS;
    })
    .await;
    let path = format!("/sessions/{}/frames", sessions[0]);
    let mut held = Vec::new();
    for _ in 0..6 {
        held.extend(hold_body_with(&app, &path, &line).await);
    }
    // The key may hold a quarter of the memory, and the page's bodies count towards that quarter.
    assert_eq!(held.len(), 1);
    let mut picture = pictures::png(1);
    picture.resize(HELD / 2, 0);
    let answer = app.post_frame(&sessions[1], picture).await;
    expect(answer, StatusCode::OK).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stalled_requests_of_a_page_leave_places_to_the_other_sessions_of_its_key() {
    let (app, sessions, line) = beside_a_page(|config| config.queue = 16).await;
    let head = format!(
        "POST /sessions/{}/frames HTTP/1.1\r\nHost: localhost\r\n{line}\r\nContent-Length: 9\r\n\
         Expect: 100-continue\r\n\r\n",
        sessions[0]
    );
    let mut stalled = Vec::new();
    for _ in 0..4 {
        let mut connection = RawConnection::open(app.address).await;
        connection.send(&head).await;
        let answer = connection.read_some().await;
        if answer.starts_with("HTTP/1.1 100") {
            stalled.push(connection);
        } else {
            assert!(answer.starts_with("HTTP/1.1 429"), "{answer}");
        }
    }
    assert_eq!(stalled.len(), 2);
    app.track(&sessions[1], 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_share_of_the_memory_for_bodies_shrinks_and_the_next_client_uploads() {
    let app = small_uploads().await;
    let mut shares = Vec::new();
    let mut held = Vec::new();
    for client in 1..=5 {
        let before = held.len();
        for _ in 0..3 {
            held.extend(hold_body(&app, &format!("198.51.100.{client}")).await);
        }
        shares.push(held.len() - before);
    }
    assert_eq!(shares, [2, 2, 2, 1, 0]);
    // A frame of usual size still goes through, whoever sends it.
    let id = open(&app, MODEST).await;
    let post = request_as(&app, MODEST, &format!("/sessions/{id}/frames"), &[]);
    let answer = post.body(pictures::png(1)).send().await.unwrap();
    expect(answer, StatusCode::OK).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn half_messages_of_one_network_leave_memory_to_others_and_end_at_their_deadline() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.max_body_bytes = HELD;
        config.max_upload_bytes = UPLOADS;
        config.body_timeout = Duration::from_secs(3);
    });
    let app = app.await;
    let mut streams = Vec::new();
    for client in 1..=4 {
        let address = format!("2001:db8:1:{client}::1");
        for _ in 0..4 {
            let id = open(&app, &address).await;
            let headers = [("x-forwarded-for", address.as_str())];
            let stream = StreamClient::try_open(app.address, &id, "", &headers).await;
            streams.push(stream.unwrap_or_else(|refused| panic!("{refused:?}")));
        }
    }
    let began = Instant::now();
    for stream in &mut streams {
        // The head of a binary message of 250,000 bytes, masked with zeros. Its last thousand bytes never come.
        stream
            .send_raw(&[0x82, 0xFF, 0, 0, 0, 0, 0, 3, 0xD0, 0x90, 0, 0, 0, 0])
            .await;
        stream.send_raw(&vec![0; 249_000]).await;
    }
    // Without the limit, the messages would take 8 MB.
    let held = async { while upload_bytes(&app).await < UPLOADS / 2 - HELD / 2 {} };
    within(held, "the messages are charged").await;
    let mut picture = pictures::png(0);
    picture.resize(HELD, 0);
    let request = request_as(&app, MODEST, "/sessions", &[("box", BOX)]);
    let opened = request.body(picture).send().await.unwrap();
    expect(opened, StatusCode::CREATED).await;
    // The memory of a frame's body may be freed a moment after its answer: hence `HELD` in addition.
    assert!(upload_bytes(&app).await <= UPLOADS / 2 + HELD);
    let mut ends = Vec::new();
    for mut stream in streams {
        ends.push(loop {
            if let Received::Closed(code) = stream.receive().await {
                break code;
            }
        });
    }
    let took = began.elapsed();
    println!("{ends:?} after {took:?}");
    // The rest of the message did not come in time (4408), or there was no memory for it (4503).
    assert!(
        ends.iter().all(|code| [4408, 4503].contains(code)),
        "{ends:?}"
    );
    assert!(took < Duration::from_secs(30), "{took:?}");
    let freed = async { while upload_bytes(&app).await > 0 {} };
    within(freed, "all is given back").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clients_that_fill_the_queue_leave_a_place_to_one_that_has_none() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        (config.queue, config.workers) = (4, Some(1));
        config.max_frames = heavy::FRAMES;
    });
    let app = app.await;
    let id = open(&app, MODEST).await;
    let mut long = tokio::task::JoinSet::new();
    for client in 1..=4 {
        let post = heavy::post(&app, &heavy::open(&app).await, heavy::FRAMES);
        let client = format!("198.51.100.{client}");
        long.spawn(post.header("x-forwarded-for", client).send());
    }
    let inside =
        async { while value(&metrics(&app).await, "bagtrack_requests_inside", &[]) < 4.0 {} };
    within(inside, "they take all places").await;
    for t in 1..=3 {
        let post = request_as(&app, MODEST, &format!("/sessions/{id}/frames"), &[]);
        let answer = post.body(pictures::png(t)).send().await.unwrap();
        // Must not be 503.
        expect(answer, StatusCode::OK).await;
    }
    let second = heavy::post(&app, &heavy::open(&app).await, 2);
    let second = second.header("x-forwarded-for", "198.51.100.1").send();
    expect_problem(second.await.unwrap(), "queue-full").await;
    assert!(long.try_join_next().is_none(), "the long posts go on");
}

#[tokio::test]
async fn the_share_of_streams_shrinks_and_the_next_client_opens_one() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.max_connections = 32;
    });
    let app = app.await;
    let mut streams = Vec::new();
    let mut shares = Vec::new();
    for client in 1..=5 {
        let address = format!("198.51.100.{client}");
        let before = streams.len();
        for _ in 0..9 {
            let id = open(&app, &address).await;
            let headers = [("x-forwarded-for", address.as_str())];
            match StreamClient::try_open(app.address, &id, "", &headers).await {
                Ok(stream) => streams.push(stream),
                Err(refused) => assert_eq!(refused.status(), 429),
            }
        }
        shares.push(streams.len() - before);
    }
    assert_eq!(shares, [8, 8, 8, 4, 2]);
    let id = open(&app, MODEST).await;
    app.track(&id, 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn posts_of_two_frames_do_not_wait_until_the_long_posts_of_another_client_end() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.workers = Some(1);
        config.max_frames = 2 * heavy::FRAMES;
        config.limits.max_request_cpu = Duration::from_secs(60);
    });
    let app = Arc::new(app.await);
    let mut long = tokio::task::JoinSet::new();
    for _ in 0..2 {
        let session = heavy::open(&app).await;
        let post = heavy::post(&app, &session, 2 * heavy::FRAMES);
        long.spawn(post.header("x-forwarded-for", GREEDY).send());
    }
    let id = open(&app, MODEST).await;
    // Waits until the long requests are at work.
    let busy = async {
        while app
            .get("/metrics")
            .await
            .text()
            .await
            .unwrap()
            .lines()
            .all(|line| line != "bagtrack_workers_busy 1")
        {}
    };
    within(busy, "they begin").await;
    for _ in 0..3 {
        let post = heavy::post(&app, &format!("/sessions/{id}"), 2);
        let answer = post.header("x-forwarded-for", MODEST).send().await.unwrap();
        expect(answer, StatusCode::OK).await;
    }
    assert!(long.try_join_next().is_none(), "the long posts go on");
}

/// Sends two large frames of a client, after posts of it that were refused at once; beside them, another client's
/// frames. Returns the time of the large frames, and the number of the others with the time of the slowest.
async fn beside_slow_frames(
    app: &TestApplication,
    (cheap, modest): (&str, &str),
) -> (Duration, u32, Duration) {
    let query = [("box", "2000,1500,1600,1200")];
    let picture = heavy::large(10);
    let slow = async |count: usize| {
        let requests = (0..count).map(|_| {
            let request = request_as(app, GREEDY, "/sessions", &query);
            request.body(picture.clone()).send()
        });
        let sent = Instant::now();
        for answer in futures_util::future::join_all(requests).await {
            expect(answer.unwrap(), StatusCode::CREATED).await;
        }
        sent.elapsed()
    };
    slow(1).await;
    for _ in 0..60 {
        let junk = request_as(app, GREEDY, &format!("/sessions/{cheap}/frames"), &[]);
        let answer = junk.body("no image at all").send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::UNSUPPORTED_MEDIA_TYPE);
    }
    let (done, mut is_done) = tokio::sync::oneshot::channel();
    let frames = async {
        let (mut number, mut slowest) = (0, Duration::ZERO);
        while is_done.try_recv().is_err() {
            number += 1;
            let sent = Instant::now();
            let post = request_as(app, MODEST, &format!("/sessions/{modest}/frames"), &[]);
            let answer = post.body(pictures::png(number)).send().await.unwrap();
            expect(answer, StatusCode::OK).await;
            slowest = slowest.max(sent.elapsed());
        }
        (number, slowest)
    };
    let attack = async {
        let took = slow(2).await;
        done.send(()).unwrap();
        took
    };
    let (took, (number, slowest)) = tokio::join!(attack, frames);
    (took, number, slowest)
}

/// Tries several times: a busy machine may stop any process for a while, but a service without a free worker always
/// stalls.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_frames_among_cheap_refused_posts_hold_not_all_quick_workers() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.workers = Some(2);
    });
    let app = app.await;
    let (cheap, modest) = (open(&app, GREEDY).await, open(&app, MODEST).await);
    let mut stalls = Vec::new();
    while stalls.len() < 3 {
        let (took, number, slowest) = beside_slow_frames(&app, (&cheap, &modest)).await;
        println!("{number} frames beside {took:?}, the slowest after {slowest:?}");
        if number > 5 && slowest < took / 3 {
            return;
        }
        stalls.push((took, number, slowest));
    }
    panic!("{stalls:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_of_a_client_that_sends_too_many_are_refused_and_change_nothing() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.workers = Some(1);
        config.queue_delay = Duration::from_millis(5);
    });
    let app = app.await;
    let post = async |client: &str, id: &str| {
        let path = format!("/sessions/{id}/frames");
        let request = request_as(&app, client, &path, &[]);
        request.body(pictures::png(1)).send().await.unwrap()
    };
    // Opened one after the other: many requests at once could be refused.
    let mut sessions = Vec::new();
    for _ in 0..48 {
        sessions.push(open(&app, GREEDY).await);
    }
    // Each session sends its next frame after the answer to the last one, until the service has refused one.
    let flood = async |id: String| {
        let mut frame = 0;
        loop {
            let answer = post(GREEDY, &id).await;
            if answer.status() != StatusCode::OK {
                let after = answer.headers()["retry-after"].clone();
                expect_problem(answer, "queue-full").await;
                break (id, frame, after);
            }
            frame += 1;
        }
    };
    let floods = sessions.into_iter().map(|id| Box::pin(flood(id)));
    let first_refusal = futures_util::future::select_all(floods);
    let modest = async {
        let id = open(&app, MODEST).await;
        loop {
            let answer = post(MODEST, &id).await;
            expect(answer, StatusCode::OK).await;
        }
    };
    let ((id, frame, after), ..) = tokio::select! {
        refused = first_refusal => refused,
        () = modest => unreachable!("it ends by a panic only"),
        () = tokio::time::sleep(Duration::from_secs(60)) => panic!("none is refused"),
    };
    assert_eq!(after, "1");
    let path = format!("/sessions/{id}");
    let request = app.request(Method::GET, &path, &[]);
    let view = request
        .header("x-forwarded-for", GREEDY)
        .send()
        .await
        .unwrap();
    assert_eq!(expect(view, StatusCode::OK).await["frames"], frame + 1);
}

/// If the frames of a request were refused one by one, the lines before the refusal would be all that it gets.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn several_frames_of_a_request_wait_where_single_ones_are_refused() {
    const FRAMES: usize = 40;
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.workers = Some(1);
        config.queue_delay = Duration::from_millis(5);
    });
    let app = app.await;
    let mut ids = Vec::new();
    for _ in 0..24 {
        ids.push(open(&app, GREEDY).await);
    }
    let refused = &Notify::new();
    let single = async |id: String| -> Infallible {
        loop {
            let path = format!("/sessions/{id}/frames");
            let request = request_as(&app, GREEDY, &path, &[]).body(pictures::png(1));
            if request.send().await.unwrap().status() == StatusCode::SERVICE_UNAVAILABLE {
                refused.notify_one();
            }
        }
    };
    let id = ids.pop().expect("it is one of those that are open");
    let several = async {
        refused.notified().await;
        let mut form = Form::new();
        for _ in 0..FRAMES {
            form = form.part("frame", Part::bytes(pictures::png(1)));
        }
        let path = format!("/sessions/{id}/frames");
        let request = request_as(&app, GREEDY, &path, &[]).header("accept", LINES);
        let answer = request.multipart(form).send().await.unwrap();
        (answer.status(), answer.text().await.unwrap())
    };
    let singles = futures_util::future::join_all(ids.into_iter().map(single));
    let (status, lines) = tokio::select! {
        answered = within(several, "all frames") => answered,
        _ = singles => unreachable!("they have no end"),
    };
    assert_eq!(status, StatusCode::OK, "{lines}");
    assert_eq!(lines.lines().count(), FRAMES, "{lines}");
    assert!(!lines.contains("queue-full"), "{lines}");
}

/// Opens connections from this address with requests that do not end, until one is refused.
async fn hold_connections(app: &TestApplication, from: IpAddr) -> Vec<RawConnection> {
    let mut held = Vec::new();
    loop {
        let mut connection = RawConnection::open_from(from, app.address).await;
        let head = "POST /sessions?box=1,1,20,20 HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n\
                    Content-Length: 1000\r\nExpect: 100-continue\r\n\r\n";
        let _ = connection.try_send(head).await;
        let answer = connection.read_some().await;
        if !answer.starts_with("HTTP/1.1 100") {
            assert!(answer.starts_with("HTTP/1.1 429"), "{answer}");
            return held;
        }
        held.push(connection);
    }
}

#[tokio::test]
async fn the_share_of_connections_shrinks_with_each_address_and_the_next_one_still_gets_one() {
    let app = TestApplication::start_with(|config| {
        config.max_connections = 32;
        config.queue = 256;
    });
    let app = app.await;
    let address = |last: u8| IpAddr::from([127, 0, 1, last]);
    let mut held = Vec::new();
    for last in 1..=6 {
        held.push(hold_connections(&app, address(last)).await);
    }
    // Each address gets half of what is free, up to its share, so that a few cannot take all connections.
    let counts: Vec<usize> = held.iter().map(Vec::len).collect();
    assert_eq!(counts, [8, 8, 8, 4, 2, 1]);
    let mut next = RawConnection::open_from(address(7), app.address).await;
    let request = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    next.send(request).await;
    let answer = next.read_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    // Connections that an address has closed are free for others.
    held[0].clear();
    let mut later = Vec::new();
    while later.len() < 4 {
        later.extend(hold_connections(&app, address(8)).await);
    }
}
