//! Services without a store that end: the session goes on from a snapshot or its first frame, at another service or at
//! the restarted one, with the same boxes.

use crate::application::TestApplication;
use crate::clip::{CLIP, written};
use crate::replica::Replica;
use bagtrack::http::{Config, Secret};
use bagtrack_client::{Client, ClientBuilder, ClientError, OpenOptions, Session};
use serde_json::Value;
use std::time::Duration;

const KEY: &str = "the secret of this year";

fn replica() -> Replica {
    Replica::start_in(&[("BAGTRACK_SNAPSHOT_KEYS", KEY)], &[])
}

/// Opens a session without a seed, so that the service draws one.
async fn open(client: ClientBuilder) -> Session {
    let client = client.retry_for(Duration::from_secs(120)).build().unwrap();
    let options = OpenOptions::new();
    let opened = client.open(CLIP.frames[0].clone(), CLIP.rect(), &options);
    opened.await.unwrap()
}

/// The library's answers to this number of frames, with the seed of the session.
async fn expected(address: &str, session: &Session, frames: usize) -> Vec<Value> {
    let view = reqwest::get(format!("{address}/sessions/{}", session.id())).await;
    let view: Value = view.unwrap().json().await.unwrap();
    let seed = view["parameters"]["seed"].as_u64().unwrap();
    CLIP.tracked(seed, &CLIP.frames[1..=frames])
}

async fn follow(session: &mut Session, numbers: std::ops::RangeInclusive<usize>, all: &[Value]) {
    for number in numbers {
        let answer = session.track(CLIP.frames[number].clone()).await.unwrap();
        assert_eq!(written(&answer), all[number - 1], "frame {number}");
    }
}

#[tokio::test]
async fn a_service_that_was_killed_and_started_again_gives_the_same_boxes() {
    let mut service = replica();
    let address = service.url("");
    let mut session = open(Client::builder(&address).snapshot_every(10)).await;
    let all = expected(&address, &session, 40).await;
    let first = session.id();
    follow(&mut session, 1..=5, &all).await;
    // There is no snapshot yet: the client opens the session again with the first frame and the drawn seed.
    service.kill();
    service.start_again();
    follow(&mut session, 6..=25, &all).await;
    assert_ne!(session.id(), first);
    assert_eq!(session.resent(), 5);
    // The last snapshot is that of frame 20.
    service.kill();
    service.start_again();
    follow(&mut session, 26..=26, &all).await;
    assert_eq!(session.resent(), 10);
    // A request with several frames is sent again as one.
    let batch = CLIP.frames[27..=29].to_vec();
    let answers = session.track_many(batch).await.unwrap();
    let answers: Vec<Value> = answers.iter().map(written).collect();
    assert_eq!(answers, all[26..29]);
    service.kill();
    service.start_again();
    let snapshot = session.snapshot().await.unwrap();
    assert_eq!((session.frame(), session.resent()), (29, 19));
    let client = Client::new(&address).unwrap();
    let mut restored = client.restore(snapshot).await.unwrap();
    assert_eq!(restored.frame(), 29);
    follow(&mut restored, 30..=40, &all).await;
    follow(&mut session, 30..=40, &all).await;
}

#[tokio::test]
async fn a_session_goes_on_at_the_next_address() {
    let (mut first, second) = (replica(), replica());
    let client = Client::builder(first.url("")).or_at(second.url(""));
    let mut session = open(client.snapshot_every(10)).await;
    let all = expected(&first.url(""), &session, 30).await;
    follow(&mut session, 1..=14, &all).await;
    first.kill();
    follow(&mut session, 15..=30, &all).await;
    assert_eq!(session.resent(), 4);
}

#[tokio::test]
async fn a_service_that_is_about_to_end_is_left() {
    let start = |config: &mut Config| {
        config.access.snapshot_keys = vec![Secret::from(KEY)];
        config.shutdown_delay = Duration::from_secs(600);
    };
    let mut first = TestApplication::start_with(start).await;
    let second = TestApplication::start_with(start).await;
    let [here, there] = [&first, &second].map(|app| format!("http://{}", app.address));
    let mut session = open(Client::builder(&here).or_at(there)).await;
    let all = expected(&here, &session, 100).await;
    let id = session.id();
    follow(&mut session, 1..=10, &all).await;
    first.shut_down();
    let mut left_at = None;
    for number in 11..=100 {
        let answer = session.track(CLIP.frames[number].clone()).await.unwrap();
        assert_eq!(written(&answer), all[number - 1], "frame {number}");
        if session.is_draining() {
            assert_eq!(left_at, None, "it was left with the first such answer");
            left_at = Some(number as u64);
        }
    }
    let left_at = left_at.expect("the service was about to end");
    assert_eq!(first.frames_of(&id.to_string()).await, left_at + 1);
    assert_eq!(second.frames_of(&session.id().to_string()).await, 101);
    assert_eq!(
        session.resent(),
        0,
        "its snapshot was that of its last frame"
    );
}

/// The only service drains: the session stays there to its end.
#[tokio::test]
async fn where_nothing_else_is_a_session_stays() {
    let start = |config: &mut Config| config.shutdown_delay = Duration::from_secs(600);
    let mut app = TestApplication::start_with(start).await;
    let here = format!("http://{}", app.address);
    let mut session = open(Client::builder(&here)).await;
    let all = expected(&here, &session, 60).await;
    let id = session.id();
    app.shut_down();
    follow(&mut session, 1..=60, &all).await;
    assert_eq!((session.id(), session.resent()), (id, 0));
}

#[tokio::test]
async fn what_was_not_kept_is_lost() {
    // Without common snapshot keys, no other process accepts the snapshot.
    for (every, why) in [(2, "It could not be opened again"), (0, "")] {
        let mut service = Replica::start(&[]);
        let mut session = open(Client::builder(service.url("")).snapshot_every(every)).await;
        for frame in &CLIP.frames[1..4] {
            session.track(frame.clone()).await.unwrap();
        }
        service.kill();
        service.start_again();
        let error = session.track(CLIP.frames[4].clone()).await.unwrap_err();
        let ClientError::Refused(problem) = error else {
            panic!("{error}")
        };
        assert_eq!(problem.kind(), "session-not-found");
        assert!(problem.detail.contains(why), "{}", problem.detail);
    }
}
