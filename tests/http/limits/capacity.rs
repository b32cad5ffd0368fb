//! Many requests at once.

use crate::application::{TestApplication, expect, expect_problem};
use crate::helpers::heavy;
use crate::pictures;
use bagtrack_testing::within::within;
use reqwest::StatusCode;
use std::time::Duration;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn numbered_posts_at_once_are_tracked_in_the_order_of_their_numbers() {
    // Few enough that, on a busy machine, the last one does not time out while it waits for the others.
    const POSTS: u64 = 8;
    let app = TestApplication::start_with(|config| config.session_queue = 32).await;
    let (id, other) = (app.open().await, app.open().await);
    // The last comes first.
    let posts = (1..=POSTS).rev();
    let posts = posts.map(|t| app.post_numbered(&id, t, pictures::png(t as u32)));
    let mut together = Vec::new();
    for response in futures_util::future::join_all(posts).await {
        together.push(expect(response, StatusCode::OK).await);
    }
    together.reverse();
    let mut alone = Vec::new();
    for t in 1..=POSTS {
        let response = app.post_frame(&other, pictures::png(t as u32)).await;
        alone.push(expect(response, StatusCode::OK).await);
    }
    assert_eq!(together, alone);
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
