//! Idle sessions expire.

use crate::application::{TestApplication, expect, expect_problem};
use crate::helpers::raw::RawConnection;
use crate::pictures;
use reqwest::StatusCode;
use std::time::Duration;

const IDLE: Duration = Duration::from_secs(600);
const ALMOST: Duration = Duration::from_secs(540);

#[tokio::test]
async fn a_session_expires_when_it_is_not_used() {
    let app = TestApplication::start_with(|config| config.session_idle = IDLE).await;
    let id = app.open().await;
    let mut expires_at = String::new();
    for t in 1..4 {
        if t > 1 {
            app.clock.advance(ALMOST);
        }
        app.track(&id, t).await;
        let view = expect(app.get_session(&id).await, StatusCode::OK).await;
        let now = view["expires_at"].as_str().unwrap().to_owned();
        assert!(now > expires_at, "use moves the expiry on");
        expires_at = now;
    }
    app.clock.advance(ALMOST);
    // Reading the session does not keep it alive.
    expect(app.get_session(&id).await, StatusCode::OK).await;
    assert!(!app.snapshot(&id).await.is_empty());
    app.clock.advance(IDLE - ALMOST);
    // For a while the service says of this id that the session has expired; other ids are unknown.
    let late = app.post_frame(&id, pictures::png(4)).await;
    expect_problem(late, "session-expired").await;
    expect_problem(app.get_session(&id).await, "session-expired").await;
    expect_problem(app.snapshot_of(&id).await, "session-expired").await;
    let unknown = "67e55044-10b1-426f-9247-bb680e5fe0c8";
    expect_problem(app.get_session(unknown).await, "session-not-found").await;
    app.clock.advance(Duration::from_secs(24 * 3600));
    expect_problem(app.get_session(&id).await, "session-not-found").await;
}

#[tokio::test]
async fn a_session_does_not_expire_while_a_frame_is_on_its_way() {
    let app = TestApplication::start_with(|config| config.session_idle = IDLE).await;
    let id = app.open().await;
    let frame = pictures::png(1);
    let target = format!("/sessions/{id}/frames");
    let mut slow = RawConnection::hold(app.address, "POST", &target, frame.len()).await;
    app.clock.advance(2 * IDLE);
    slow.send(&frame).await;
    let answer = slow.read_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    assert_eq!(app.frames_of(&id).await, 2);
}

#[tokio::test]
async fn a_frame_that_is_refused_does_not_keep_its_session_alive() {
    let app = TestApplication::start_with(|config| config.session_idle = IDLE).await;
    let (id, new) = (app.open().await, app.open().await);
    app.track(&id, 1).await;
    let refused = app.post_frame(&new, b"no frame".to_vec()).await;
    expect_problem(refused, "unsupported-image").await;
    app.clock.advance(Duration::from_secs(61));
    expect_problem(app.get_session(&new).await, "session-expired").await;
    app.clock.advance(ALMOST - Duration::from_secs(61));
    let other = app.post_frame(&id, pictures::png_of(64, 48)).await;
    expect_problem(other, "frame-size-mismatch").await;
    let mut damaged = pictures::png(2);
    damaged.truncate(300);
    expect_problem(app.post_frame(&id, damaged).await, "frame-damaged").await;
    expect_problem(app.post_frame(&id, Vec::new()).await, "missing-frame").await;
    app.clock.advance(IDLE - ALMOST);
    expect_problem(app.get_session(&id).await, "session-expired").await;
}

#[tokio::test]
async fn a_frame_that_finds_no_room_and_one_sent_again_keep_their_session_alive() {
    let app = TestApplication::start_with(|config| {
        config.session_idle = IDLE;
        config.limits.client_requests = Some(1);
    });
    let app = app.await;
    let id = app.open().await;
    let first = || app.post_numbered(&id, 1, pictures::png(1));
    expect(first().await, StatusCode::OK).await;
    app.clock.advance(ALMOST);
    expect(first().await, StatusCode::OK).await;
    app.clock.advance(ALMOST);
    let target = format!("/sessions/{}/frames", app.open().await);
    let held = RawConnection::hold(app.address, "POST", &target, 1000).await;
    let refused = app.post_frame(&id, pictures::png(2)).await;
    expect_problem(refused, "quota-exceeded").await;
    drop(held);
    app.clock.advance(ALMOST);
    expect(app.get_session(&id).await, StatusCode::OK).await;
}
