//! Tracks a clip with the Rust client, which numbers frames, and sends those without an answer again.

use crate::clip::Clip;
use bagtrack_client::{Client, OpenOptions, Rect, Session};
use serde_json::Value;
use std::time::Duration;
use uuid::Uuid;

/// The answer to a frame, as the service wrote it.
pub type Answer = Value;

/// A session that tracks a clip, with the answers so far.
pub struct Track {
    session: Session,
    /// The session's id when it was opened.
    id: Uuid,
    clip: Clip,
    /// The answers to frames 1, 2, …
    pub answers: Vec<Answer>,
}

impl Track {
    /// Opens a session at `base`: the address of the service, or of a balancer or proxy before it.
    pub async fn open(base: String, http: reqwest::Client, number: usize, clip: Clip) -> Self {
        let client = Client::builder(base).http(http);
        let client = client.timeout(Duration::from_secs(10));
        let client = client.retry_for(Duration::from_secs(120));
        Self::open_by(client.build().expect("a client"), number, clip).await
    }

    /// Opens a session with the seed `number`.
    pub async fn open_by(client: Client, number: usize, clip: Clip) -> Self {
        let numbers = clip.first_box.split(',');
        let numbers: Vec<f64> = numbers.map(|number| number.parse().unwrap()).collect();
        let [x, y, width, height] = numbers[..] else {
            panic!("{} is no box", clip.first_box)
        };
        let target = Rect::from([x, y, width, height]);
        let options = OpenOptions::new().seed(number as u64);
        let session = client.open(clip.frames[0].clone(), target, &options).await;
        let session = session.unwrap_or_else(|error| panic!("session {number}: {error}"));
        Self {
            id: session.id(),
            session,
            clip,
            answers: Vec::new(),
        }
    }

    /// Sends the next frame. False if none is left.
    pub async fn advance(&mut self) -> bool {
        let number = self.answers.len() + 1;
        let Some(frame) = self.clip.frames.get(number) else {
            return false;
        };
        let answer = self.session.track(frame.clone()).await;
        let answer =
            answer.unwrap_or_else(|error| panic!("session {}, frame {number}: {error}", self.id));
        assert_eq!(answer.frame, number as u64, "session {}", self.id);
        self.answers.push(serde_json::to_value(answer).unwrap());
        true
    }

    pub fn id(&self) -> Uuid {
        self.id
    }

    /// How many answered frames the service has asked for again.
    pub fn resent(&self) -> u64 {
        self.session.resent()
    }

    /// Whether the service lost the session, so that another one took its place.
    pub fn was_lost(&self) -> bool {
        self.session.id() != self.id
    }

    /// Whether the service went back behind a frame that it had answered, or lost the session.
    pub fn went_back(&self) -> bool {
        self.session.resent() > 0 || self.was_lost()
    }

    /// A snapshot of the session. Equal snapshots mean that all later boxes are equal, too.
    pub async fn snapshot(&mut self) -> Vec<u8> {
        let snapshot = self.session.snapshot().await;
        let snapshot = snapshot.unwrap_or_else(|error| panic!("session {}: {error}", self.id));
        snapshot.to_vec()
    }

    /// Sends all frames that are left, and returns the answers to all.
    pub async fn follow(mut self) -> Vec<Answer> {
        while self.advance().await {}
        self.answers
    }
}
