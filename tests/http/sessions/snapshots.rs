//! Moving a session to another instance by a snapshot.

use crate::application::{BOX, TestApplication, expect, expect_detail, expect_problem};
use crate::helpers::forged;
use crate::pictures;
use crate::requests::forms::form;
use bagtrack::http::Secret;
use bagtrack_sessions::{Fingerprint, SNAPSHOT_MAGIC};
use bagtrack_tracker::{Estimate, Frame, Preset, Rect, Tracker};
use flate2::Compression;
use flate2::write::DeflateEncoder;
use reqwest::StatusCode;
use std::io::Write;

/// A stored answer: the frame's digest, the box that was given, the answer.
type Answered = (Fingerprint, Option<Rect>, Estimate);

const OLD: &str = "the secret of last year";
const NEW: &str = "the secret of this year";

/// A service with these snapshot secrets.
async fn with_secrets(secrets: &[&str]) -> TestApplication {
    let secrets = secrets.iter().copied().map(Secret::from).collect();
    TestApplication::start_with(|config| config.access.snapshot_keys = secrets).await
}

/// A service that takes unsigned snapshots, and up to `max_frames` frames in a request.
async fn unsigned(max_frames: usize) -> TestApplication {
    TestApplication::start_with(|config| {
        config.access.unsigned_snapshots = true;
        config.max_frames = max_frames;
    })
    .await
}

#[tokio::test]
async fn a_session_goes_on_elsewhere_bit_for_bit() {
    let (here, there) = (with_secrets(&[OLD]).await, with_secrets(&[NEW, OLD]).await);
    let id = here.open().await;
    for t in 1..12 {
        here.post_frame(&id, pictures::png(t)).await;
    }
    let view = expect(here.get_session(&id).await, StatusCode::OK).await;
    let snapshot = here.snapshot(&id).await;
    let query = [("verbose", "true")];
    let restored = expect(there.create(snapshot, &query).await, StatusCode::CREATED).await;
    let new_id = restored["id"].as_str().unwrap();
    assert_ne!(new_id, id);
    assert_eq!(restored["frame"], 11);
    assert_eq!(restored["box"], view["answer"]["box"]);
    assert_eq!(restored["parameters"], view["parameters"]);

    // The last frame can be sent again at the new instance, too, and gets its stored answer.
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
    let (app, id) = TestApplication::with_session().await;
    let snapshot = app.snapshot(&id).await;
    let magic = SNAPSHOT_MAGIC.len();
    for position in (magic..snapshot.len()).step_by(snapshot.len() / 40) {
        let mut damaged = snapshot.clone();
        damaged[position] ^= 0x10;
        let response = app.create(damaged, &[]).await;
        expect_problem(response, "invalid-snapshot").await;
        let response = app.create(snapshot[..position].to_vec(), &[]).await;
        expect_problem(response, "invalid-snapshot").await;
    }
    for added in [1, 1 << 10, 1 << 19] {
        let longer = [snapshot.clone(), vec![0x10; added]].concat();
        let response = app.create(longer, &[]).await;
        expect_problem(response, "invalid-snapshot").await;
    }
    let response = app.create(snapshot, &[("box", BOX)]).await;
    expect_problem(response, "malformed-request").await;
}

#[tokio::test]
async fn a_snapshot_is_taken_from_services_with_the_same_secret_only() {
    let restored = async |from: &TestApplication, to: &TestApplication| {
        let id = from.open().await;
        to.create(from.snapshot(&id).await, &[]).await
    };
    let (old, new) = (with_secrets(&[OLD]).await, with_secrets(&[NEW]).await);
    let both = with_secrets(&[NEW, OLD]).await;
    let (none, other) = (
        TestApplication::start().await,
        TestApplication::start().await,
    );
    let (open, open_too) = (unsigned(64).await, unsigned(64).await);
    // While a secret is replaced, both are accepted, and the new one signs.
    for (from, to) in [
        (&old, &both),
        (&both, &new),
        (&none, &none),
        (&open, &open_too),
    ] {
        expect(restored(from, to).await, StatusCode::CREATED).await;
    }
    for (from, to) in [
        (&old, &new),
        (&both, &old),
        (&none, &other),
        (&open, &none),
        (&old, &open),
    ] {
        expect_detail(
            restored(from, to).await,
            "invalid-snapshot",
            &["BAGTRACK_SNAPSHOT_KEYS"],
        )
        .await;
    }
}

/// The snapshot of a tracker in a page or a program opens a session only where unsigned snapshots are accepted.
#[tokio::test]
async fn a_tracker_goes_on_in_a_service_that_takes_unsigned_snapshots() {
    let frame = |t| {
        let picture = image::load_from_memory(&pictures::png(t))
            .unwrap()
            .into_rgb8();
        Frame::from_rgb(picture.width(), picture.height(), &picture).unwrap()
    };
    let [x, y, width, height] =
        [0, 1, 2, 3].map(|at| BOX.split(',').nth(at).unwrap().parse().unwrap());
    let target = Rect::new(x, y, width, height);
    let mut tracker = Tracker::new(&frame(0), target, Preset::Robust.params()).unwrap();
    for t in 1..8 {
        tracker.step(&frame(t)).unwrap();
    }
    let snapshot = tracker.snapshot();

    let strict = TestApplication::start().await;
    let refused = strict.create(snapshot.clone(), &[]).await;
    expect_problem(refused, "invalid-snapshot").await;

    let open = unsigned(64).await;
    let mut damaged = snapshot.clone();
    *damaged.last_mut().unwrap() ^= 1;
    expect_problem(open.create(damaged, &[]).await, "invalid-snapshot").await;
    let created = expect(open.create(snapshot, &[]).await, StatusCode::CREATED).await;
    assert_eq!(created["frame"], 7);
    let id = created["id"].as_str().unwrap();
    let again = open.post_numbered(id, 7, pictures::png(7)).await;
    expect_problem(again, "frame-differs").await;
    for t in 8..16 {
        let answer = open.track(id, t).await;
        let estimate = tracker.step(&frame(t)).unwrap();
        // The service rounds to a hundredth.
        for (side, value) in [("x", estimate.target.x), ("width", estimate.target.width)] {
            assert!((answer["box"][side].as_f64().unwrap() - value).abs() <= 0.005);
        }
    }
}

/// An unsigned snapshot with another list of stored answers.
fn with_answers(snapshot: &[u8], change: impl FnOnce(&mut Vec<Answered>)) -> Vec<u8> {
    let content = forged::content(snapshot);
    let (tracker, rest) = postcard::take_from_bytes::<&[u8]>(&content).unwrap();
    let mut recent: Vec<Answered> = postcard::from_bytes(rest).unwrap();
    change(&mut recent);
    let content = postcard::to_stdvec(&(tracker, recent)).unwrap();
    forged::with_content(snapshot, &content)
}

#[tokio::test]
async fn a_forged_list_of_stored_answers_is_refused() {
    let app = unsigned(64).await;
    let id = app.open().await;
    app.track(&id, 1).await;
    let snapshot = app.snapshot(&id).await;
    let same = with_answers(&snapshot, |_| ());
    let long = with_answers(&snapshot, |recent| *recent = recent.repeat(200_000));
    assert!(long.len() > 10_000_000);
    expect_problem(app.create(long, &[]).await, "invalid-snapshot").await;
    let empty = with_answers(&snapshot, Vec::clear);
    expect_problem(app.create(empty, &[]).await, "invalid-snapshot").await;
    expect(app.create(same, &[]).await, StatusCode::CREATED).await;
}

#[tokio::test]
async fn a_forged_length_takes_no_memory_and_is_refused() {
    let app = unsigned(64).await;
    let snapshot = app.snapshot(&app.open().await).await;
    let content = forged::content(&snapshot);
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&vec![0; 1 << 26]).unwrap();
    let zeros = encoder.finish().unwrap();
    for (length, compressed) in [
        (u32::MAX, &content[..]),
        (1 << 26, &zeros),
        (8 * zeros.len() as u32, &zeros),
        (0, &[]),
    ] {
        let other = forged::with_compressed(&snapshot, length, compressed);
        expect_problem(app.create(other, &[]).await, "invalid-snapshot").await;
    }
}

#[tokio::test]
async fn of_more_stored_answers_than_a_request_may_have_the_last_32_are_kept() {
    let (here, there) = (unsigned(64).await, unsigned(2).await);
    let id = here.open().await;
    let request = here.frames_request(&id, &[]);
    let posted = request.multipart(form((1..=40).map(pictures::png)));
    expect(posted.send().await.unwrap(), StatusCode::OK).await;
    let first = here.post_numbered(&id, 1, pictures::png(1)).await;
    assert_eq!(first.headers()["replayed"], "true");
    let full = here.snapshot(&id).await;
    let restored = expect(there.create(full, &[]).await, StatusCode::CREATED).await;
    let id = restored["id"].as_str().unwrap();
    let kept = there.post_numbered(id, 9, pictures::png(9)).await;
    assert_eq!(kept.headers()["replayed"], "true");
    let dropped = there.post_numbered(id, 8, pictures::png(8)).await;
    expect_problem(dropped, "frame-out-of-order").await;
}
