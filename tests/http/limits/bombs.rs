//! Requests that cost far more to answer than to send.

use crate::application::{TestApplication, expect, expect_problem};
use crate::helpers::heavy;
use crate::operation::metrics::{metrics, readiness, value};
use crate::pictures;
use crate::requests::forms::form;
use bagtrack_testing::within::within;
use reqwest::StatusCode;
use std::time::{Duration, Instant};

/// A box in a frame of 8000 x 5000.
const LARGE_BOX: &str = "2000,1500,1600,1200";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sixty_four_bombs_of_another_size_hold_no_worker() {
    let app = TestApplication::start().await;
    let bomb = heavy::bomb();
    assert!(bomb.len() < 20_000, "{}", bomb.len());
    let (id, other) = (app.open().await, app.open().await);
    let attack = |id: &str| {
        let request = app.frames_request(id, &[]);
        request.multipart(form(vec![bomb.clone(); 64])).send()
    };
    let sent = Instant::now();
    let (first, second) = tokio::join!(attack(&id), attack(&other));
    for refused in [first.unwrap(), second.unwrap()] {
        let problem = expect_problem(refused, "frame-size-mismatch").await;
        assert_eq!(problem["index"], 0);
    }
    app.track(&id, 1).await;
    // Without the limit, decoding all frames would take both workers half a minute.
    assert_eq!(decoded(&app).await, 3, "those that were taken");
    assert!(
        sent.elapsed() < Duration::from_secs(15),
        "{:?}",
        sent.elapsed()
    );
    assert_eq!(app.frames_of(&other).await, 1);
}

/// How many frames were decoded, whether they were taken or not.
async fn decoded(app: &TestApplication) -> usize {
    value(
        &metrics(app).await,
        "bagtrack_frame_decode_seconds_count",
        &[],
    ) as usize
}

#[tokio::test]
async fn the_size_of_the_last_frame_is_checked_before_the_first_is_decoded() {
    let (app, id) = TestApplication::with_session().await;
    let mut damaged = pictures::png(1);
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0xFF;
    let form = form([damaged, pictures::png_of(64, 48)]);
    let request = app.frames_request(&id, &[]);
    let refused = request.multipart(form).send().await.unwrap();
    let problem = expect_problem(refused, "frame-size-mismatch").await;
    assert_eq!(problem["index"], 1);
}

#[tokio::test]
async fn work_past_its_deadline_stops_at_the_next_frame() {
    let app = TestApplication::start_with(|config| {
        config.workers = Some(1);
        config.max_frames = 2 * heavy::FRAMES;
        config.work_timeout = Duration::from_millis(300);
    });
    let app = app.await;
    let session = heavy::open(&app).await;
    let request = heavy::post(&app, &session, 2 * heavy::FRAMES);
    expect_problem(request.send().await.unwrap(), "work-timeout").await;
    // When a session can be opened, the only worker is free again: it has dropped the other frames.
    within(heavy::open(&app), "the worker is free").await;
    let decoded = decoded(&app).await;
    assert!(decoded < 2 * heavy::FRAMES, "{decoded} frames");
    let view = expect(app.get(&session).await, StatusCode::OK).await;
    assert_eq!(view["frames"], 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn work_whose_client_has_gone_stops_at_the_next_frame() {
    let app = TestApplication::start_with(|config| {
        (config.workers, config.queue) = (Some(1), 1);
        config.max_frames = 2 * heavy::FRAMES;
        config.limits.half_close_timeout = Duration::from_millis(10);
    });
    let app = app.await;
    let (session, id) = (heavy::open(&app).await, app.open().await);
    let request = heavy::post(&app, &session, 2 * heavy::FRAMES);
    let client = heavy::send_raw(&app, &format!("{session}/frames"), request).await;
    // Waits until the long request has the only place in the queue; `/readyz` itself takes none.
    readiness(&app, StatusCode::SERVICE_UNAVAILABLE).await;
    drop(client);
    let ask = || app.post_frame(&id, pictures::png(1));
    let freed = async { while ask().await.status() != StatusCode::OK {} };
    within(freed, "the place is free again").await;
    let view = expect(app.get(&session).await, StatusCode::OK).await;
    assert_eq!(view["frames"], 1, "what was done is undone");
}

/// The time of a frame of forty megapixels after a replay, and that of the slowest answer beside it. A replay takes
/// next to no time; that must not make the service take the session's frames for cheap ones.
async fn beside_a_large_frame(app: &TestApplication) -> (Duration, Duration) {
    let (first, next) = (heavy::large(10), heavy::large(20));
    let response = app.create(first.clone(), &[("box", LARGE_BOX)]).await;
    let created = expect(response, StatusCode::CREATED).await;
    let id = created["id"].as_str().unwrap();
    let replayed = app
        .put_target(id, first, &[("box", LARGE_BOX), ("frame", "0")])
        .await;
    assert_eq!(replayed.headers()["replayed"], "true");
    let (done, mut is_done) = tokio::sync::oneshot::channel();
    let ask = async {
        let (mut slowest, mut asked) = (Duration::ZERO, 0);
        while is_done.try_recv().is_err() {
            let sent = Instant::now();
            expect(app.get("/healthz").await, StatusCode::OK).await;
            slowest = slowest.max(sent.elapsed());
            asked += 1;
        }
        assert!(asked > 10, "{asked} answers");
        slowest
    };
    let post = async {
        let sent = Instant::now();
        expect(app.post_numbered(id, 1, next).await, StatusCode::OK).await;
        done.send(()).unwrap();
        sent.elapsed()
    };
    tokio::join!(post, ask)
}

/// Tries several times: a busy machine may stop any process for a while, but a service with this fault always stalls.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_frame_of_forty_megapixels_after_a_replay_does_not_stall_the_network_threads() {
    let app = TestApplication::start_with(|config| {
        config.workers = Some(1);
        // Makes the test's client a trusted proxy, whose requests have no rate limit.
        config.limits.trusted_proxies = vec!["127.0.0.1/32".parse().unwrap()];
    });
    let app = app.await;
    let mut stalls = Vec::new();
    while stalls.len() < 3 {
        let (took, slowest) = beside_a_large_frame(&app).await;
        println!("{took:?} for the frame, the slowest answer of /healthz after {slowest:?}");
        if slowest < took / 2 {
            return;
        }
        stalls.push((took, slowest));
    }
    panic!("{stalls:?}");
}
