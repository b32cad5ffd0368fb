//! A session carried to another instance.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use reqwest::StatusCode;

#[tokio::test]
async fn a_session_goes_on_elsewhere_bit_for_bit() {
    let (here, there) = (
        TestApplication::start().await,
        TestApplication::start().await,
    );
    let id = here.open().await;
    for t in 1..12 {
        here.post_frame(&id, pictures::png(t)).await;
    }
    let view = expect(here.get_session(&id).await, StatusCode::OK).await;
    let snapshot = here.snapshot(&id).await;
    let restored = expect(there.create(snapshot, &[]).await, StatusCode::CREATED).await;
    let new_id = restored["id"].as_str().unwrap();
    assert_ne!(new_id, id);
    assert_eq!(restored["frame"], 11);
    assert_eq!(restored["box"], view["answer"]["box"]);
    assert_eq!(restored["params"], view["params"]);

    // The last frame can be asked for again there, too.
    let again = there.post_numbered(new_id, 11, pictures::png(11)).await;
    assert_eq!(again.headers()["replayed"], "true");
    assert_eq!(expect(again, StatusCode::OK).await, view["answer"]);
    let differs = there.post_numbered(new_id, 11, pictures::png(3)).await;
    expect_problem(differs, "frame-differs").await;

    for t in 12..24 {
        let a = here
            .post_frame(&id, pictures::png(t))
            .await
            .bytes()
            .await
            .unwrap();
        let b = there
            .post_frame(new_id, pictures::png(t))
            .await
            .bytes()
            .await
            .unwrap();
        assert_eq!(a, b);
    }
}

#[tokio::test]
async fn a_damaged_snapshot_is_refused() {
    let app = TestApplication::start().await;
    let id = app.open().await;
    let snapshot = app.snapshot(&id).await;
    let magic = bagtrack::sessions::SNAPSHOT_MAGIC.len();
    for position in (magic..snapshot.len()).step_by(snapshot.len() / 40) {
        let mut damaged = snapshot.clone();
        damaged[position] ^= 0x10;
        let response = app.create(damaged, &[]).await;
        expect_problem(response, "invalid-snapshot").await;
        let response = app.create(snapshot[..position].to_vec(), &[]).await;
        expect_problem(response, "invalid-snapshot").await;
    }
    let response = app.create(snapshot, &[("box", BOX)]).await;
    expect_problem(response, "malformed-request").await;
}
