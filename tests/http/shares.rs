//! What one client may hold, and that others get theirs beside it.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::heavy;
use crate::pictures;
use bagtrack::http::Config;
use image::{GrayImage, ImageFormat, Luma};
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use std::sync::Arc;
use std::time::{Duration, Instant};

const GREEDY: &str = "198.51.100.1";
const MODEST: &str = "203.0.113.1";

fn behind_a_proxy(config: &mut Config) {
    config.limits.trusted_proxies = vec!["127.0.0.0/8".parse().unwrap()];
}

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
    let request = request_as(app, client, "/sessions", &[("box", BOX)]);
    let opened = request.body(pictures::png(0)).send().await.unwrap();
    let opened = expect(opened, StatusCode::CREATED).await;
    opened["id"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn one_client_with_costly_sessions_leaves_memory_for_those_of_others() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.limits.max_session_bytes = Some(64 << 20);
    });
    let app = app.await;
    let mut opened = 0;
    let refused = loop {
        let answer = open_dear(&app, GREEDY).await;
        if answer.status() != StatusCode::CREATED {
            break answer;
        }
        opened += 1;
    };
    // It once got all of them, and everybody else 503.
    let problem = expect_problem(refused, "quota-exceeded").await;
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("bytes of sessions"), "{detail}");
    assert!(opened >= 2, "{opened}");
    expect(open_dear(&app, MODEST).await, StatusCode::CREATED).await;
    let id = open(&app, MODEST).await;
    expect(app.post_frame(&id, pictures::png(1)).await, StatusCode::OK).await;
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
    // The long ones are at work when single frames wait for their turns.
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
    tokio::time::timeout(Duration::from_secs(60), busy)
        .await
        .expect("they begin");
    for _ in 0..3 {
        let post = heavy::post(&app, &format!("/sessions/{id}"), 2);
        let answer = post.header("x-forwarded-for", MODEST).send().await.unwrap();
        expect(answer, StatusCode::OK).await;
    }
    assert!(long.try_join_next().is_none(), "the long posts go on");
}

/// A picture of 40 megapixels.
fn large(value: u8) -> Vec<u8> {
    let picture = GrayImage::from_fn(8000, 5000, |x, y| {
        Luma([value + ((x / 80) ^ (y / 50)) as u8 % 90])
    });
    pictures::encode(picture, ImageFormat::Png)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_frames_among_cheap_refused_posts_hold_not_all_quick_workers() {
    let app = TestApplication::start_with(|config| {
        behind_a_proxy(config);
        config.workers = Some(2);
    });
    let app = Arc::new(app.await);
    let query = [("box", "2000,1500,1600,1200")];
    let picture = large(10);
    let slow = async |count: usize| {
        let requests = (0..count).map(|_| {
            let request = request_as(&app, GREEDY, "/sessions", &query);
            request.body(picture.clone()).send()
        });
        let sent = Instant::now();
        for answer in futures_util::future::join_all(requests).await {
            expect(answer.unwrap(), StatusCode::CREATED).await;
        }
        sent.elapsed()
    };
    let (cheap, modest) = (open(&app, GREEDY).await, open(&app, MODEST).await);
    slow(1).await;
    for _ in 0..60 {
        let junk = request_as(&app, GREEDY, &format!("/sessions/{cheap}/frames"), &[]);
        let answer = junk.body("no image at all").send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::UNSUPPORTED_MEDIA_TYPE);
    }
    let (done, mut is_done) = tokio::sync::oneshot::channel();
    let frames = async {
        let (mut number, mut slowest) = (0, Duration::ZERO);
        while is_done.try_recv().is_err() {
            number += 1;
            let sent = Instant::now();
            let post = request_as(&app, MODEST, &format!("/sessions/{modest}/frames"), &[]);
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
    println!("{number} frames beside {took:?}, the slowest after {slowest:?}");
    assert!(
        number > 5 && slowest < took / 3,
        "{number}, {slowest:?} of {took:?}"
    );
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
    // Each sends its next frame once it has an answer, until one was refused.
    let flood = async || {
        let id = open(&app, GREEDY).await;
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
    let floods = (0..48).map(|_| Box::pin(flood()));
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
