//! What one client may have, and that others get their turn beside it.

use crate::application::{TestApplication, behind_a_proxy, expect, expect_detail, expect_problem};
use crate::helpers::heavy;
use crate::helpers::raw::RawConnection;
use crate::pictures;
use bagtrack::http::Secret;
use bagtrack_testing::within::within;
use reqwest::{Method, StatusCode};
use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use tokio::task::JoinSet;

#[tokio::test]
async fn one_client_cannot_take_all_sessions() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.max_sessions = 8;
    });
    let app = app.await;
    let mut paths = Vec::new();
    for left in ["1", "0"] {
        let created = app.create_as("198.51.100.1").await;
        let limit = created.headers()["ratelimit"].to_str().unwrap().to_owned();
        assert!(limit.contains(&format!("\"sessions\";r={left}")), "{limit}");
        paths.push(created.headers()["location"].to_str().unwrap().to_owned());
        expect(created, StatusCode::CREATED).await;
    }
    let refused = app.create_as("198.51.100.1").await;
    let policy = refused.headers()["ratelimit-policy"].to_str().unwrap();
    assert!(policy.contains("\"sessions\";q=2"), "{policy}");
    assert_eq!(refused.headers()["retry-after"], "10");
    let parts = ["2 sessions", "Delete sessions that are done"];
    expect_detail(refused, "quota-exceeded", &parts).await;
    expect(app.create_as("198.51.100.2").await, StatusCode::CREATED).await;
    let deleted = app
        .request(Method::DELETE, &paths[0], &[])
        .send()
        .await
        .unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    expect(app.create_as("198.51.100.1").await, StatusCode::CREATED).await;
}

#[tokio::test]
async fn an_address_that_no_trusted_proxy_forwards_is_not_believed() {
    let app = TestApplication::start_with(|config| config.max_sessions = 4).await;
    expect(app.create_as("198.51.100.1").await, StatusCode::CREATED).await;
    expect_problem(app.create_as("198.51.100.2").await, "quota-exceeded").await;
}

#[tokio::test]
async fn frames_a_second_are_counted_and_their_rest_is_told() {
    let app = TestApplication::start_with(|config| {
        config.limits.client_frame_rate = 1;
        config.max_frames = 4;
    });
    let app = app.await;
    let id = app.open().await;
    for t in 1..4 {
        let response = app.post_frame(&id, pictures::png(t)).await;
        let policy = response.headers()["ratelimit-policy"].to_str().unwrap();
        assert!(policy.contains("\"frames\";q=4;w=4"), "{policy}");
        expect(response, StatusCode::OK).await;
    }
    let mut sent = 3;
    let refused = loop {
        let response = app.post_frame(&id, pictures::png(1)).await;
        if response.status() != StatusCode::OK {
            break response;
        }
        sent += 1;
    };
    let limit = refused.headers()["ratelimit"].to_str().unwrap();
    assert!(limit.contains("\"frames\";r=0;t=4"), "{limit}");
    let wait: u64 = refused.headers()["retry-after"]
        .to_str()
        .unwrap()
        .parse()
        .unwrap();
    assert!((1..=4).contains(&wait), "{wait}");
    expect_problem(refused, "quota-exceeded").await;
    assert_eq!(app.frames_of(&id).await, 1 + sent);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_with_one_session_gets_its_turn_beside_one_with_forty() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.workers = Some(1);
        // A client may have a quarter of this memory: forty of the test's sessions.
        config.limits.max_session_bytes = Some(1 << 30);
    });
    let app = app.await;
    let mut greedy = JoinSet::new();
    static WAITED: AtomicU64 = AtomicU64::new(0);
    static ANSWERED: AtomicU64 = AtomicU64::new(0);
    let mut urls = Vec::new();
    for _ in 0..40 {
        urls.push(format!(
            "http://{}{}/frames",
            app.address,
            heavy::open(&app).await
        ));
    }
    let id = app.open().await;
    for url in urls {
        let client = app.client.clone();
        greedy.spawn(async move {
            loop {
                let sent = Instant::now();
                let request = client.post(&url).header("x-forwarded-for", "198.51.100.1");
                let Ok(answer) = request.body(pictures::png(1)).send().await else {
                    return;
                };
                assert_eq!(answer.status(), StatusCode::OK);
                let waited = sent.elapsed().as_micros() as u64;
                WAITED.fetch_add(waited, Ordering::Relaxed);
                ANSWERED.fetch_add(1, Ordering::Relaxed);
            }
        });
    }
    while ANSWERED.load(Ordering::Relaxed) < 40 {
        tokio::task::yield_now().await;
    }
    let sent = Instant::now();
    for t in 1..=20 {
        app.track(&id, t).await;
    }
    let modest = sent.elapsed().as_micros() as u64 / 20;
    let greedy = WAITED.load(Ordering::Relaxed) / ANSWERED.load(Ordering::Relaxed);
    println!("{modest} µs beside {greedy} µs");
    assert!(modest < greedy / 4, "{modest} µs beside {greedy} µs");
}

#[tokio::test]
async fn what_is_left_of_the_frames_comes_back_and_is_told_by_every_call() {
    let app = TestApplication::start_with(|config| {
        config.limits.client_frame_rate = 50;
        config.max_frames = 50;
    });
    let app = app.await;
    let id = app.open().await;
    app.track(&id, 1).await;
    // `/readyz` takes no place in the queue.
    let full = async {
        loop {
            let response = app.get_session(&id).await;
            let left = response.headers()["ratelimit"].to_str().unwrap().to_owned();
            if left.contains("\"frames\";r=50;") {
                break;
            }
        }
    };
    within(full, "the frames come back").await;
    let refused = app.request(Method::POST, "/track", &[]).send().await;
    assert!(refused.unwrap().headers().contains_key("ratelimit"));
}

const ASK: &str = "GET /version HTTP/1.1\r\nHost: localhost\r\n\r\n";

/// hyper would answer 16 of them before anybody else has a turn.
#[tokio::test]
async fn requests_that_came_at_once_leave_turns_to_other_connections() {
    let app = TestApplication::start().await;
    let mut many = RawConnection::open(app.address).await;
    let mut one = RawConnection::open(app.address).await;
    for connection in [&mut many, &mut one] {
        connection.send(ASK).await;
        connection.read_answer().await;
    }
    many.send_now(ASK.repeat(64));
    one.send_now(ASK);
    one.read_answer().await;
    let before = many.answers_now();
    assert!(before < 8, "{before}");
}

/// Sends a request again and again, many copies at once.
async fn flood(address: SocketAddr, ask: &str) {
    let mut connection = RawConnection::open(address).await;
    loop {
        connection.send(ask.repeat(50)).await;
        connection.read_answers(50).await;
    }
}

const NO_KEY: &str = "POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_asks_too_often_is_refused_and_its_probes_its_frames_and_others_are_not() {
    // Requests without a key, which are refused, count too.
    for ask in [ASK, NO_KEY] {
        let app = TestApplication::start_with(|config| {
            config.access.api_keys = vec![Secret::from("me:0123456789abcdef")];
        });
        let app = app.await;
        let id = app.open().await;
        let mut floods = JoinSet::new();
        for _ in 0..8 {
            floods.spawn(flood(app.address, ask));
        }
        let refused = async {
            loop {
                let answer = app.get("/version").await;
                if answer.status() != StatusCode::OK {
                    break answer;
                }
            }
        };
        let refused = within(refused, "it is bounded").await;
        assert_eq!(refused.headers()["retry-after"], "1");
        expect_detail(refused, "quota-exceeded", &["500 requests a second"]).await;
        for probe in ["/healthz", "/readyz"] {
            assert_eq!(app.get(probe).await.status(), StatusCode::OK, "{probe}");
        }
        app.track(&id, 1).await;
        let mut other = RawConnection::open_from(IpAddr::from([127, 0, 0, 9]), app.address).await;
        other.send(ASK).await;
        let answer = other.read_answer().await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        floods.shutdown().await;
        let again = async { while app.get("/version").await.status() != StatusCode::OK {} };
        within(again, "it comes back").await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_trusted_proxy_asks_for_itself_as_often_as_it_likes() {
    let app = TestApplication::start_with(behind_a_proxy).await;
    let mut proxy = RawConnection::open(app.address).await;
    for _ in 0..40 {
        proxy.send(ASK.repeat(100)).await;
        let answers = proxy.read_answers(100).await;
        assert!(!answers.contains("HTTP/1.1 429"), "{answers}");
    }
}
