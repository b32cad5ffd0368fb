//! The live sessions: a map of them, and what keeps them apart.
//!
//! In: a [`SessionState`], which is a tracker for each target and the stored answers: to the last [`KEPT_ANSWERS`]
//! frames, or to all frames of the last request where these are more. Out: a [`Session`] in the [`Registry`], found by
//! its id.
//!
//! All requests go through [`SessionService`]. A request for a session takes these steps: [`SessionService::find`]
//! finds it for its owner, [`Session::enter`] takes one of its few permits, [`Charge::grow`] charges the bytes of its
//! body as they arrive, [`Admission::enter`] takes a place in the queue before the workers, and
//! [`SessionService::advance`] waits for the session in order of arrival, and works with a copy of its state on a
//! worker thread.
//!
//! What can go wrong, and what is done about it:
//! - Requests wait for the map. Its lock is held for a look-up only, never during work, and nothing is freed under it.
//! - Two requests step one tracker at once. A session has a lock of its own, taken in order of arrival.
//! - Work outlives the request that asked for it. It keeps its permits until it has really ended.
//! - A client loses the answer to a frame. It sends the frame again with its number: see [`ReplayError`].
//! - A client never ends its session. The session expires when no frame comes for a while, sooner where none came at
//!   all. Time passes by a [`Clock`] that tests can move forward.
//! - A snapshot comes back damaged or forged. It carries a code under a key of the service ([`MacKeys`]), and all in it
//!   is checked and bounded: see [`SnapshotError`].

#![warn(clippy::disallowed_methods)]

mod acts;
pub mod clock;
mod compression;
mod expired;
mod insertion;
#[cfg(all(test, feature = "shuttle"))]
mod interleavings;
mod mac;
mod planted;
pub mod random;
mod registry;
mod replay;
mod scheduler;
mod selection;
mod session;
mod session_permit;
mod snapshot;
mod state;
mod store;
mod streams;
mod sync;
mod targets;

pub use acts::{
    ActError, CreationKey, FrameBatch, FrameFault, FramesError, GivenBox, IdempotencyStore,
    KEPT_ANSWERS, OpenError, OpenRequest, Opened, QuotaExhausted, RequestLimits, ServiceParts,
    ServiceSettings, SessionQuota, SessionService, Start, TrackError, TrackFrom, Tracked,
    TrackedAway, TrackingMetrics, check_readable_pixels,
};
pub use clock::Clock;
pub use insertion::InsertError;
pub use mac::{MAC_BYTES, MacKeys};
#[cfg(feature = "planted-faults")]
pub use planted::{PlantedFault, plant};
pub use registry::{NoSession, Registry, TooManySessions};
pub use replay::{Fingerprint, ReplayError};
pub use scheduler::admission::{Admission, NoOutcome, QueueFull, WorkPanicked};
pub use scheduler::budget::{Budget, BudgetFull, Charge, ChargedBytes};
pub use scheduler::executor::{AfterWork, Executor, Work, threads_of};
pub use scheduler::fair_queue::WorkerSlot;
pub use scheduler::flows::Flow;
pub use scheduler::queue_permit::{QueuePermit, Reservation, Ticket};
pub use scheduler::work_limit::{CpuSpent, Stopped, WorkLimit, WorkMeter};
pub use selection::Selection;
pub use session::{Lease, NewSession, Opening, Owner, Session, short_id};
pub use session_permit::{LockedSession, SessionBusy, SessionClosed, SessionPermit};
pub use snapshot::{
    KEY_CONTEXT as SNAPSHOT_KEY_CONTEXT, MAGIC as SNAPSHOT_MAGIC, SnapshotError, is_snapshot,
};
pub use state::SessionState;
pub use store::{
    AddressError, Commit, Counted, Durability, DurabilityError, FileStore, FileStoreError, Outcome,
    Record, SessionName, SessionStore, StoreAddress, StoreFuture, StoreShare, StoreUnavailable,
    UnreadableRecord, Version,
};
#[cfg(feature = "redis")]
pub use store::{NewHash, RedisAddress, RedisAddressError, RedisStore, ScriptServer};
#[cfg(fuzzing)]
pub use store::{record_of_row, row_and_state};
pub use streams::{OpenStreams, StreamPlace};
pub use targets::{
    Boxes, Correction, Estimates, MAX_LIST_BYTES, MAX_TARGETS, PerTarget, StartError, frame_format,
    largest_format,
};
