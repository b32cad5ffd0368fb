//! Many requests at once.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::helpers::heavy;
use crate::helpers::raw::RawConnection;
use crate::pictures;
use bagtrack_testing::within::within;
use reqwest::StatusCode;
use std::time::{Duration, Instant};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn numbered_posts_at_once_are_tracked_in_the_order_of_their_numbers() {
    let app = TestApplication::start_with(|config| config.session_queue = 32).await;
    let (id, other) = (app.open().await, app.open().await);
    // The last comes first.
    let posts = (1..=16).rev();
    let posts = posts.map(|t| app.post_numbered(&id, t, pictures::png(t as u32)));
    let mut together = Vec::new();
    for response in futures_util::future::join_all(posts).await {
        together.push(expect(response, StatusCode::OK).await);
    }
    together.reverse();
    let mut alone = Vec::new();
    for t in 1..=16 {
        let response = app.post_frame(&other, pictures::png(t)).await;
        alone.push(expect(response, StatusCode::OK).await);
    }
    assert_eq!(together, alone);
}

#[tokio::test]
async fn an_early_frame_waits_for_its_turn_for_a_bounded_time() {
    let app = TestApplication::start().await;
    let id = app.open().await;
    let started = Instant::now();
    let alone = app.post_numbered(&id, 2, pictures::png(2)).await;
    expect_problem(alone, "frame-out-of-order").await;
    assert!(started.elapsed() > Duration::from_secs(1), "it waited");
    let far = app.post_numbered(&id, 99, pictures::png(2)).await;
    expect_problem(far, "frame-out-of-order").await;
    let early = app.post_numbered(&id, 2, pictures::png(2));
    let due = async {
        // A post without a number tells whether the early one is there.
        let probe = async || app.post_frame(&id, b"no image".to_vec()).await;
        while probe().await.status() != StatusCode::CONFLICT {}
        app.post_numbered(&id, 1, pictures::png(1)).await
    };
    let (early, due) = tokio::join!(early, due);
    assert_eq!(expect(due, StatusCode::OK).await["frame"], 1);
    assert_eq!(expect(early, StatusCode::OK).await["frame"], 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn unnumbered_posts_at_once_are_refused_but_for_the_first() {
    let app = TestApplication::start().await;
    let id = app.open().await;
    let frame = pictures::png(1);
    let target = format!("/sessions/{id}/frames");
    let mut first = RawConnection::hold(app.address, "POST", &target, frame.len()).await;
    let second = app.post_frame(&id, pictures::png(2)).await;
    expect_problem(second, "not-in-order").await;
    let corrected = app.put_target(&id, pictures::png(2), &[("box", BOX)]).await;
    expect_problem(corrected, "not-in-order").await;
    first.send(&frame).await;
    assert!(first.read_to_end().await.starts_with("HTTP/1.1 200"));
    // The next one finds nobody there.
    let next = app.post_frame(&id, pictures::png(2)).await;
    assert_eq!(expect(next, StatusCode::OK).await["frame"], 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sessions_do_not_disturb_each_other() {
    let app = TestApplication::start().await;
    let track = async || {
        let id = app.open().await;
        let mut answers = Vec::new();
        for t in 1..10 {
            answers.push(
                app.post_frame(&id, pictures::png(t))
                    .await
                    .text()
                    .await
                    .unwrap(),
            );
        }
        answers
    };
    let alone = track().await;
    for together in futures_util::future::join_all((0..6).map(|_| track())).await {
        assert_eq!(together, alone);
    }
}

#[tokio::test]
async fn a_session_takes_a_bounded_number_of_requests_and_frees_their_places() {
    let app = TestApplication::start_with(|config| config.session_queue = 2).await;
    let (id, other) = (app.open().await, app.open().await);
    let frame = pictures::png(1);
    let target = |number: u32| format!("/sessions/{id}/frames?frame={number}");
    let mut first = RawConnection::hold(app.address, "POST", &target(1), frame.len()).await;
    let mut second = RawConnection::hold(app.address, "POST", &target(2), frame.len()).await;
    expect_problem(app.post_frame(&id, frame.clone()).await, "session-busy").await;
    // Looking at it and other sessions go on.
    assert_eq!(app.frames_of(&id).await, 1);
    expect(app.post_frame(&other, frame.clone()).await, StatusCode::OK).await;
    for held in [&mut first, &mut second] {
        held.send(&frame).await;
        assert!(held.read_to_end().await.starts_with("HTTP/1.1 200"));
    }
    expect(app.post_frame(&id, frame).await, StatusCode::OK).await;
    assert_eq!(app.frames_of(&id).await, 4);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_queue_is_bounded_and_a_lost_client_frees_its_place() {
    let app = TestApplication::start_with(|config| {
        (config.queue, config.workers) = (1, Some(1));
        config.max_frames = heavy::FRAMES;
        config.limits.half_close_timeout = Duration::from_millis(10);
    });
    let app = app.await;
    let id = app.open().await;
    let busy = heavy::fill_queue(&app).await;
    expect_problem(app.post_frame(&id, pictures::png(1)).await, "queue-full").await;
    drop(busy);
    let freed =
        async { while app.post_frame(&id, pictures::png(1)).await.status() != StatusCode::OK {} };
    within(freed, "the place is free again").await;
    assert_eq!(app.frames_of(&id).await, 2);
}

#[tokio::test]
async fn a_request_that_waits_for_a_deleted_session_is_told_so() {
    let app = TestApplication::start().await;
    let id = app.open().await;
    let frame = pictures::png(1);
    let target = format!("/sessions/{id}/frames");
    let mut held = RawConnection::hold(app.address, "POST", &target, frame.len()).await;
    assert_eq!(
        app.delete_session(&id).await.status(),
        StatusCode::NO_CONTENT
    );
    held.send(&frame).await;
    let answer = held.read_to_end().await;
    assert!(
        answer.starts_with("HTTP/1.1 404") && answer.contains("session-not-found"),
        "{answer}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_that_wait_for_those_before_them_hold_no_places_in_the_queue() {
    let app = TestApplication::start_with(|config| {
        config.queue = 4;
        config.limits.client_requests = Some(100);
    });
    let app = std::sync::Arc::new(app.await);
    let mut early = tokio::task::JoinSet::new();
    let mut sessions = Vec::new();
    for _ in 0..4 {
        let id = app.open().await;
        sessions.push(id.clone());
        for number in 2..=4 {
            let (app, id) = (app.clone(), id.clone());
            early.spawn(async move {
                let frame = pictures::png(number as u32);
                app.post_numbered(&id, number, frame).await.status()
            });
        }
    }
    // They are at their sessions, with more frames than there are places.
    let id = app.open().await;
    let started = std::time::Instant::now();
    let mut answered = 0;
    while started.elapsed() < Duration::from_millis(1500) {
        expect(app.post_frame(&id, pictures::png(1)).await, StatusCode::OK).await;
        answered += 1;
    }
    assert!(answered > 2, "{answered}");
    // Their turn comes.
    for id in &sessions {
        let first = app.post_numbered(id, 1, pictures::png(1)).await;
        expect(first, StatusCode::OK).await;
    }
    drop(early.join_all().await);
}
