//! What an answer says about the store: `Checkpoint: N`, and `Durable: false`.

use crate::sessions::Session;
use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;

const CHECKPOINT: HeaderName = HeaderName::from_static("checkpoint");
const DURABLE: HeaderName = HeaderName::from_static("durable");

/// What the store has of a session.
#[derive(Debug, Clone, Copy, Default)]
pub struct Durability {
    /// The last frame whose state is in the store.
    checkpoint: Option<u64>,
    /// The first frame that is not in the store, where there is a store.
    lacks_from: Option<u64>,
}

impl Durability {
    /// Of a session, as it stands, of a service with or without a store.
    pub fn of(session: &Session, has_store: bool) -> Self {
        let version = session.version();
        let lacks_from = version.map_or(0, |version| version.frame + 1);
        Self {
            checkpoint: version.map(|version| version.checkpoint),
            lacks_from: has_store.then_some(lacks_from),
        }
    }

    /// The last frame whose state is in the store.
    pub fn checkpoint(&self) -> Option<u64> {
        self.checkpoint
    }

    /// Whether this frame is not in the store, although it should be.
    pub fn lacks(&self, frame: u64) -> bool {
        self.lacks_from.is_some_and(|first| frame >= first)
    }

    /// Adds the headers to the answer to this frame.
    pub fn write(self, frame: u64, mut response: Response) -> Response {
        let headers = response.headers_mut();
        if let Some(frame) = self.checkpoint {
            headers.insert(CHECKPOINT, HeaderValue::from(frame));
        }
        if self.lacks(frame) {
            headers.insert(DURABLE, HeaderValue::from_static("false"));
        }
        response
    }
}
