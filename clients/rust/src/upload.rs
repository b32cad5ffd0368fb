//! The frames of one request, and the origin from which a session is opened.

use crate::transport::{Body, Query, Request};
use bagtrack_api::Rect;
use bagtrack_api::media_types::FRAME;
use bytes::Bytes;
use reqwest::Method;
use uuid::Uuid;

/// Frames of a session that are sent in one request.
#[derive(Debug, Clone, PartialEq)]
pub struct Upload {
    /// At least one.
    pub frames: Vec<Bytes>,
    /// With one frame only: the index of a target, and its right box in pixels.
    pub correction: Option<(usize, Rect)>,
}

impl Upload {
    /// The number of the last frame, if the first one has the number `first`.
    pub fn last(&self, first: u64) -> u64 {
        first + self.frames.len() as u64 - 1
    }

    /// The request that sends the frames to this session, numbered from `number`.
    pub fn request(&self, id: Uuid, number: u64) -> Request {
        let mut query: Query = vec![("frame", number.to_string())];
        let (method, path) = match self.correction {
            None => (Method::POST, "frames"),
            Some((target, rect)) => {
                query.push(("box", rect.to_string()));
                query.push(("target", target.to_string()));
                (Method::PUT, "target")
            }
        };
        let body = match &self.frames[..] {
            [frame] => Body::Bytes(FRAME, frame.clone()),
            frames => Body::Frames(frames.to_vec()),
        };
        let path = format!("/sessions/{id}/{path}");
        Request {
            method,
            path,
            query,
            body,
        }
    }
}

/// The origin of a session: a first frame with its settings, or a snapshot.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// The last frame that the session has when it is opened from this origin.
    pub frame: u64,
    pub query: Query,
    pub media_type: &'static str,
    pub body: Bytes,
}

impl Origin {
    /// The request that opens a session with this id; its answer has the parameters.
    pub fn request(&self, id: Uuid) -> Request {
        let mut query = self.query.clone();
        query.push(("verbose", "true".to_owned()));
        Request {
            method: Method::PUT,
            path: format!("/sessions/{id}"),
            query,
            body: Body::Bytes(self.media_type, self.body.clone()),
        }
    }
}
