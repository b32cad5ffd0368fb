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
    /// Whether the frame of the answer is not in the store, although it should be.
    lacks_frame: bool,
}

impl Durability {
    /// Of a session, as it stands.
    pub fn of(session: &Session) -> Self {
        Self {
            checkpoint: session.version().map(|version| version.checkpoint),
            lacks_frame: false,
        }
    }

    /// Of a session whose last frame could not be written.
    pub fn lacking_frame(session: &Session) -> Self {
        Self {
            lacks_frame: true,
            ..Self::of(session)
        }
    }

    /// The last frame whose state is in the store.
    pub fn checkpoint(&self) -> Option<u64> {
        self.checkpoint
    }

    /// Whether the frame of the answer is not in the store, although it should be.
    pub fn lacks_frame(&self) -> bool {
        self.lacks_frame
    }

    /// Adds the headers to an answer.
    pub fn write(self, mut response: Response) -> Response {
        let headers = response.headers_mut();
        if let Some(frame) = self.checkpoint {
            headers.insert(CHECKPOINT, HeaderValue::from(frame));
        }
        if self.lacks_frame {
            headers.insert(DURABLE, HeaderValue::from_static("false"));
        }
        response
    }
}
