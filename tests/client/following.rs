//! The client's boxes are those of the library, and those that the service gives to other clients.

use crate::application::{TestApplication, expect};
use crate::clip::{CLIP, written};
use bagtrack_client::{Client, OpenOptions, Preset, Rect, Session};
use reqwest::StatusCode;
use serde_json::Value;

const SEED: u64 = 7;

fn client(app: &TestApplication) -> Client {
    Client::new(format!("http://{}", app.address)).unwrap()
}

async fn open(app: &TestApplication) -> Session {
    let options = OpenOptions::new().seed(SEED);
    let first = CLIP.frames[0].clone();
    let opened = client(app).open(first, CLIP.rect(), &options).await;
    opened.unwrap()
}

#[tokio::test]
async fn a_hundred_frames_get_the_librarys_boxes() {
    let app = TestApplication::start().await;
    let frames = &CLIP.frames[1..];
    let expected = CLIP.tracked(SEED, frames);
    let mut session = open(&app).await;
    for (frame, expected) in frames.iter().zip(&expected) {
        let answer = session.track(frame.clone()).await.unwrap();
        assert_eq!(written(&answer), *expected);
    }
    assert_eq!((session.frame(), session.resent()), (100, 0));
    let id = session.id().to_string();
    assert_eq!(app.frames_of(&id).await, 101);
    session.end().await.unwrap();
    assert_eq!(
        app.get_session(&id).await.status(),
        StatusCode::NOT_FOUND,
        "it has ended"
    );
}

#[tokio::test]
async fn many_frames_in_a_request_get_the_same_answers() {
    let app = TestApplication::start().await;
    let frames = &CLIP.frames[1..61];
    let mut session = open(&app).await;
    assert_eq!(session.track_many(Vec::<Vec<u8>>::new()).await.unwrap(), []);
    let mut answers = Vec::new();
    for batch in [&frames[..1], &frames[1..21], &frames[21..60]] {
        answers.extend(session.track_many(batch.to_vec()).await.unwrap());
    }
    let answers: Vec<Value> = answers.iter().map(written).collect();
    assert_eq!(answers, CLIP.tracked(SEED, frames));
}

/// A session with three targets whose second one is corrected, with settings, as others open and drive it.
#[tokio::test]
async fn several_targets_and_corrections_are_as_the_service_has_them() {
    let app = TestApplication::start().await;
    let first = CLIP.rect();
    let behind = Rect {
        x: first.x + 60.5,
        ..first
    };
    let moved = Rect {
        x: behind.x + 3.25,
        ..behind
    };
    let boxes = format!("{first};{behind};{moved}");
    let query = [
        ("boxes", boxes.as_str()),
        ("seed", "3"),
        ("preset", "paper"),
        ("parameters", r#"{"bag_size": 4}"#),
    ];
    let created = app.create(CLIP.frames[0].clone(), &query).await;
    let created = expect(created, StatusCode::CREATED).await;
    let raw = created["id"].as_str().unwrap();
    let options = OpenOptions::new().seed(3).preset(Preset::Paper);
    let options = options.parameter("bag_size", 4);
    let client = client(&app);
    let opened = client.open(CLIP.frames[0].clone(), [first, behind, moved], &options);
    let mut session = opened.await.unwrap();

    let text = moved.to_string();
    for (number, frame) in CLIP.frames.iter().enumerate().take(13).skip(1) {
        // Corrections of the second target, and of the first.
        let (expected, answer) = match number {
            5 | 9 => {
                let target = if number == 5 { 1 } else { 0 };
                let named = target.to_string();
                let query = [("box", text.as_str()), ("target", named.as_str())];
                (
                    app.put_target(raw, frame.clone(), &query).await,
                    session.correct(frame.clone(), target, moved).await,
                )
            }
            _ => (
                app.post_frame(raw, frame.clone()).await,
                session.track(frame.clone()).await,
            ),
        };
        let (expected, answer) = (expect(expected, StatusCode::OK).await, answer.unwrap());
        assert_eq!(written(&answer), expected, "frame {number}");
        assert_eq!(answer.targets().len(), 3);
        assert_eq!(answer.first, answer.targets()[0]);
    }
}

#[tokio::test]
async fn a_correction_of_the_only_target_counts_as_a_frame() {
    let app = TestApplication::start().await;
    let mut session = open(&app).await;
    let right = Rect {
        x: 50.25,
        ..CLIP.rect()
    };
    let answer = session.correct(CLIP.frames[0].clone(), 0, right).await;
    let answer = answer.unwrap();
    assert_eq!((answer.frame, answer.first.rect.x), (1, 50.25));
    assert_eq!(answer.targets, None);
    assert_eq!(
        session.track(CLIP.frames[1].clone()).await.unwrap().frame,
        2
    );
}

#[tokio::test]
async fn a_snapshot_goes_on_in_another_session() {
    let app = TestApplication::start().await;
    let frames = &CLIP.frames[1..31];
    let expected = CLIP.tracked(SEED, frames);
    let mut session = open(&app).await;
    session.track_many(frames[..20].to_vec()).await.unwrap();
    let snapshot = session.snapshot().await.unwrap();
    let mut restored = client(&app).restore(snapshot).await.unwrap();
    assert_eq!(restored.frame(), 20);
    assert_ne!(restored.id(), session.id());
    for (frame, expected) in frames[20..].iter().zip(&expected[20..]) {
        let answer = restored.track(frame.clone()).await.unwrap();
        assert_eq!(written(&answer), *expected);
    }
}
