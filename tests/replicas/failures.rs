//! What happens when a replica ends, or the store is away.

use crate::clip::Clip;
use crate::replica::Replica;
use crate::server::Redis;
use crate::tracking_client::Track;
use reqwest::{Client, StatusCode};
use serde_json::Value;
use uuid::Uuid;

struct Session {
    client: Client,
    clip: Clip,
    id: Uuid,
}

struct Answered {
    status: StatusCode,
    checkpoint: Option<String>,
    retry_after: bool,
    body: Value,
}

impl Session {
    async fn open(at: &Replica, frames: usize) -> Self {
        let session = Self {
            client: Client::new(),
            clip: Clip::of(0, frames),
            id: Uuid::new_v4(),
        };
        // On a busy machine the store may be found late.
        while at.readiness().await != StatusCode::OK {}
        let query = format!(
            "/sessions/{}?box={}&seed=3",
            session.id, session.clip.first_box
        );
        let request = session.client.put(at.url(&query));
        let request = request.body(session.clip.frames[0].clone());
        assert_eq!(request.send().await.unwrap().status(), StatusCode::CREATED);
        session
    }

    async fn post(&self, at: &Replica, number: usize) -> Answered {
        let url = at.url(&format!("/sessions/{}/frames?frame={number}", self.id));
        let request = self.client.post(url).body(self.clip.frames[number].clone());
        let answer = request.send().await.unwrap();
        let header = |name: &str| {
            let value = answer.headers().get(name)?.to_str();
            Some(value.unwrap().to_owned())
        };
        Answered {
            status: answer.status(),
            checkpoint: header("checkpoint"),
            retry_after: header("retry-after").is_some(),
            body: answer.json().await.unwrap(),
        }
    }

    async fn expected(&self) -> Vec<Value> {
        let alone = Replica::start(&[]);
        let track = Track::open(alone.url(""), Client::new(), 3, self.clip.clone());
        track.await.follow().await
    }
}

async fn until_ready(replica: &Replica, status: StatusCode) {
    while replica.readiness().await != status {}
}

#[tokio::test]
#[ignore = "needs redis"]
async fn after_the_end_of_a_replica_the_frames_after_the_checkpoint_are_asked_for() {
    let redis = Redis::start();
    let replica = || Replica::with_store(&redis.url(), &["--store-every", "10"]);
    let (mut first, second) = (replica(), replica());
    let session = Session::open(&first, 30).await;
    let expected = session.expected().await;
    for number in 1..=25 {
        let answer = session.post(&first, number).await;
        assert_eq!(answer.body, expected[number - 1]);
        let checkpoint = (number / 10 * 10).to_string();
        assert_eq!(answer.checkpoint, Some(checkpoint), "frame {number}");
    }
    first.kill();
    let answer = session.post(&second, 26).await;
    assert_eq!(answer.status, StatusCode::CONFLICT);
    assert_eq!(answer.body["expected_frame"], 21);
    for number in 21..30 {
        let answer = session.post(&second, number).await;
        assert_eq!(answer.body, expected[number - 1], "frame {number}");
    }
}

/// The same with the Rust client, which keeps those frames and sends them again.
#[tokio::test]
#[ignore = "needs redis"]
async fn the_client_sends_the_frames_after_the_checkpoint_again() {
    let redis = Redis::start();
    let replica = || Replica::with_store(&redis.url(), &["--store-every", "10"]);
    let (mut first, second) = (replica(), replica());
    for replica in [&first, &second] {
        until_ready(replica, StatusCode::OK).await;
    }
    let clip = Clip::of(0, 30);
    let alone = Replica::start(&[]);
    let undisturbed = Track::open(alone.url(""), Client::new(), 3, clip.clone());
    let expected = undisturbed.await.follow().await;
    let client = bagtrack_client::Client::builder(first.url("")).or_at(second.url(""));
    let mut track = Track::open_by(client.build().unwrap(), 3, clip).await;
    for _ in 1..=25 {
        track.advance().await;
    }
    assert!(!track.went_back());
    first.kill();
    while track.advance().await {}
    assert_eq!(track.answers, expected);
    assert_eq!(track.resent(), 5, "frames 21 to 25");
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_replica_that_is_asked_to_end_writes_what_it_has() {
    let redis = Redis::start();
    let replica = || Replica::with_store(&redis.url(), &["--store-every", "100"]);
    let (mut first, second) = (replica(), replica());
    let session = Session::open(&first, 12).await;
    for number in 1..=10 {
        let answer = session.post(&first, number).await;
        assert_eq!(answer.checkpoint.as_deref(), Some("0"));
    }
    first.end();
    let answer = session.post(&second, 11).await;
    assert_eq!(
        (answer.status, answer.checkpoint.as_deref()),
        (StatusCode::OK, Some("10"))
    );
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_replica_that_lost_a_session_to_another_goes_on_from_the_store() {
    let redis = Redis::start();
    let replica = || Replica::with_store(&redis.url(), &["--store-every", "4"]);
    let (first, second) = (replica(), replica());
    let session = Session::open(&first, 20).await;
    let expected = session.expected().await;
    for number in 1..=6 {
        session.post(&first, number).await;
    }
    // The second takes over at the checkpoint; the first still has frames 5 and 6 in memory.
    let answer = session.post(&second, 7).await;
    assert_eq!(answer.body["expected_frame"], 5);
    for number in 5..=6 {
        assert_eq!(
            session.post(&second, number).await.body,
            expected[number - 1]
        );
    }
    let stale = session.post(&first, 7).await;
    assert_eq!(
        stale.status,
        StatusCode::CONFLICT,
        "its frame 6 is another's now"
    );
    assert_eq!(stale.body["expected_frame"], 5);
    for number in 5..20 {
        let answer = session.post(&first, number).await;
        assert_eq!(answer.body, expected[number - 1], "frame {number}");
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_frame_that_comes_late_to_another_replica_takes_nothing_back() {
    let redis = Redis::start();
    let replica = || Replica::with_store(&redis.url(), &["--store-every", "10"]);
    let (first, second) = (replica(), replica());
    let session = Session::open(&first, 20).await;
    // The second has the first frame.
    let early = session.post(&second, 19).await;
    assert_eq!(early.body["expected_frame"], 1);
    for number in 1..=14 {
        session.post(&first, number).await;
    }
    for number in [1, 2, 10] {
        let late = session.post(&second, number).await;
        let is_known = number == 10;
        assert_eq!(late.status == StatusCode::OK, is_known, "frame {number}");
    }
    let next = session.post(&first, 15).await;
    assert_eq!(
        (next.status, &next.body["frame"]),
        (StatusCode::OK, &15.into())
    );
}

#[tokio::test]
#[ignore = "needs redis"]
async fn without_the_store_frames_are_refused_and_nothing_is_lost() {
    let mut redis = Redis::start();
    let replica = Replica::with_store(&redis.url(), &["--store-timeout", "300ms"]);
    let session = Session::open(&replica, 12).await;
    let expected = session.expected().await;
    for number in 1..=5 {
        session.post(&replica, number).await;
    }
    assert_eq!(replica.readiness().await, StatusCode::OK);
    redis.stop();
    for _ in 0..3 {
        let refused = session.post(&replica, 6).await;
        assert_eq!(refused.status, StatusCode::SERVICE_UNAVAILABLE);
        assert_eq!(refused.body["type"], "/docs/problems#store-unavailable");
        assert!(refused.retry_after);
    }
    until_ready(&replica, StatusCode::SERVICE_UNAVAILABLE).await;
    redis.start_again();
    until_ready(&replica, StatusCode::OK).await;
    for number in 6..12 {
        let answer = session.post(&replica, number).await;
        assert_eq!(answer.body, expected[number - 1], "frame {number}");
    }
}
