//! The acts of the service: what is done with sessions, whoever asks and over whatever line.
//!
//! In: the owner, and the parsed request. Out: estimates, sessions and snapshots, or small errors. The acts know
//! neither HTTP nor sockets. All are methods of [`SessionService`]: `find`, `open`, `advance`, `read`, `refresh`,
//! `fence`, `end` and `track`.
//!
//! [`SessionService::advance`] locks the session, tracks on a copy of its state, commits to the store,
//! [reconciles](crate::store), and makes the copy the session's state. Without a store there is no commit. So neither a
//! refused frame nor a failed commit changes the session.
//!
//! What can go wrong: another replica committed a frame first (the session goes on from the store's state, and the
//! frames are tracked again), the store is away ([`ActError::Store`]), the time of the request ends during the work
//! (the work stops between two frames, and its copy is dropped).

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
