//! The store: sessions that all replicas of the service share in a Redis (`redis`), or that one process keeps in a
//! [folder](file).
//!
//! In: the [`Record`] of a session, with the [`Version`] that this replica has of it. Out: an [`Outcome`], which
//! [`reconcile`] turns into what the replica does next. The store is the truth, and memory is a cache.
//!
//! A frame is answered after the store has moved the record's frame number from the one that this replica knows to the
//! next. Of two replicas with frames of one session at once only one can do that.
//!
//! The state itself may be written less often, at *checkpoints*. Then the record has a later frame number than its
//! state. A replica without the frames in between takes the record over: the frame number goes back to the checkpoint,
//! and the record's generation goes up, so that no other replica goes on from its own copy.
//!
//! A stream that is opened begins a generation too. So a stream at another replica, whose line may be broken without
//! its knowing, tracks no further frame.
//!
//! What can go wrong, and what is done about it:
//! - The store is away, slow or full: [`StoreUnavailable`]. Nothing is tracked then.
//! - Nobody ends a session. Each commit renews the record's time to live.
//! - The store loses a record. Then the session is gone, and clients open it again from their snapshot.
//! - A session is ended, and copies of it are in the memory of other replicas. A mark stays for as long as these may
//!   live. A new session may be opened under the same id; each has a random number of its own, its *incarnation*, which
//!   tells them apart.

mod address;
mod file;
mod reconcile;
mod record;
#[cfg(feature = "redis")]
mod redis;
mod session_store;

#[cfg(feature = "redis")]
pub use self::redis::{NewHash, RedisAddress, RedisAddressError, RedisStore, ScriptServer};
pub use address::{AddressError, StoreAddress};
pub use file::{Durability, DurabilityError, FileStore, FileStoreError};
#[cfg(fuzzing)]
pub use file::{record_of_row, row_and_state};
pub(crate) use reconcile::{Gone, Intent, Step, reconcile};
pub use record::{Record, SessionName, UnreadableRecord, Version};
pub use session_store::{
    Commit, Counted, Outcome, SessionStore, StoreFuture, StoreShare, StoreUnavailable,
};
