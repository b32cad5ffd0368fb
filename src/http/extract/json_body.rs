//! A JSON body that is no upload of frames and settings.

use super::body;
use super::json;
use super::pace::{Pace, PacedBody};
use crate::http::problems::problem::Problem;
use crate::http::quotas::clients::RequestPermit;
use crate::http::service::state::AppState;
use crate::sessions::{ByteCharge, QueuePermit};
use axum::body::{Body, Bytes};
use axum::extract::Request;
use std::sync::Arc;

/// A body of JSON, not parsed yet.
#[derive(Debug)]
pub struct JsonText {
    /// The text.
    pub bytes: Bytes,
    /// The place among the client's requests.
    pub permit: Arc<RequestPermit>,
    /// The place in the queue, which holds the memory of the text and of what parsing takes.
    pub queue: QueuePermit,
}

impl JsonText {
    /// Reads the body, then takes a place in the queue.
    ///
    /// # Errors
    /// The body cannot be read, or the queue is full.
    pub async fn read(
        state: &AppState,
        permit: RequestPermit,
        request: Request,
    ) -> Result<Self, Problem> {
        let mut charge = ByteCharge::new(&state.uploads, permit.bytes());
        let pace = Pace::of(&state.config.limits);
        let body = Body::new(PacedBody::new(request.into_body(), pace, None));
        let bytes = body::read(body, state.config.max_body_bytes, &mut charge).await?;
        charge.grow(json::DECODED_PER_BYTE * bytes.len())?;
        let (lane, permit) = (permit.lane(), Arc::new(permit));
        let queue = state
            .admission
            .enter(lane, Box::new((charge, permit.clone())))?;
        Ok(Self {
            bytes,
            permit,
            queue,
        })
    }
}
