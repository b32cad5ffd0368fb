//! Many requests at once.

use crate::application::{TestApplication, expect, expect_problem};
use crate::heavy;
use crate::pictures;
use crate::raw::RawConnection;
use reqwest::StatusCode;
use std::time::Duration;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn posts_at_once_on_one_session_are_served_one_after_the_other() {
    let app = TestApplication::start_with(|config| config.session_queue = 32).await;
    let id = app.open().await;
    let posts = (1..=20).map(|t| app.post_frame(&id, pictures::png(t)));
    let responses = futures_util::future::join_all(posts).await;
    let mut frames = Vec::new();
    for response in responses {
        let answer = expect(response, StatusCode::OK).await;
        frames.push(answer["frame"].as_u64().unwrap());
    }
    frames.sort_unstable();
    assert_eq!(frames, (1..=20).collect::<Vec<u64>>());
    assert_eq!(app.frames_of(&id).await, 21);
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
    let target = format!("/sessions/{id}/frames");
    let mut first = RawConnection::hold(app.address, "POST", &target, frame.len()).await;
    let mut second = RawConnection::hold(app.address, "POST", &target, frame.len()).await;
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
    tokio::time::timeout(Duration::from_secs(60), freed)
        .await
        .unwrap();
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
