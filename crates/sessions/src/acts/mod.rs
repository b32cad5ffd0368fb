//! The acts of the service: what is done with sessions, whoever asks and over whatever line.
//!
//! In: who asks, and what is asked, parsed. Out: estimates, sessions and snapshots, or small errors. The acts know
//! neither HTTP nor sockets. [`SessionService`] is the one door: `find`, `open`, `advance`, `read`, `refresh`, `fence`,
//! `end` and `track`.
//!
//! [`SessionService::advance`] is the heart: lock, track on a copy, commit, [reconcile](crate::store), and
//! swap the copy in. Without a store the commit is the swap alone. So a refused frame changes nothing, and neither does
//! one whose commit failed.
//!
//! What can go wrong: another replica was first (the session goes on from the store's state, and the frames are looked
//! at again), the store is away ([`ActError::Store`]), the time of the request is over while work is done (it stops
//! between two frames, and its copy is dropped).

mod advance;
mod error;
mod find;
mod frames;
mod idempotency;
mod open;
mod service;
mod start;
mod sync;
mod track;

pub use error::{ActError, FrameFault, FramesError, OpenError, QuotaExhausted, TrackError};
pub use frames::{
    FrameBatch, GivenBox, KEPT_ANSWERS, RequestLimits, Tracked, check_readable_pixels,
};
pub use idempotency::{CreationKey, IdempotencyStore};
pub use open::{OpenRequest, Opened, SessionQuota};
pub use service::{ServiceParts, ServiceSettings, SessionService, TrackingMetrics};
pub use start::Start;
pub use track::{TrackFrom, TrackedAway};
