//! Idle sessions expire.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use crate::raw::RawConnection;
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
        app.clock.advance(ALMOST);
        expect(app.post_frame(&id, pictures::png(t)).await, StatusCode::OK).await;
        let view = expect(app.get_session(&id).await, StatusCode::OK).await;
        let now = view["expires_at"].as_str().unwrap().to_owned();
        assert!(now > expires_at, "use moves the expiry on");
        expires_at = now;
    }
    app.clock.advance(IDLE);
    expect_problem(
        app.post_frame(&id, pictures::png(4)).await,
        "session-not-found",
    )
    .await;
    expect_problem(app.get_session(&id).await, "session-not-found").await;
}

#[tokio::test]
async fn expired_sessions_make_room() {
    let app = TestApplication::start_with(|config| {
        config.session_idle = IDLE;
        config.max_sessions = 1;
    });
    let app = app.await;
    app.open().await;
    let full = app.create(pictures::png(0), &[("box", BOX)]).await;
    expect_problem(full, "too-many-sessions").await;
    app.clock.advance(IDLE);
    app.open().await;
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
