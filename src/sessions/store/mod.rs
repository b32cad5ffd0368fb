//! The store: sessions in a Redis (or Valkey) that all replicas of the service share.
//!
//! In: the [`Record`] of a session, with the [`Version`] that this replica has of it. Out: that it was written, or that
//! the store has another version, with its record. The store is the truth, and memory is a cache.
//!
//! A record is a hash with the session's id in its key. Each call is one script, which Redis runs as a whole. A frame
//! is answered after its script has moved the record's frame number from the one that this replica knows to the next.
//! Of two replicas with frames of one session at once only one can do that.
//!
//! The state itself may be written less often, at *checkpoints*. Then the record has a later frame number than its
//! state. A replica without the frames in between takes the record over: the frame number goes back to the checkpoint,
//! and the record's generation goes up, so that no other replica goes on from its own copy.
//!
//! A stream that is opened begins a generation too. So a stream at another replica, whose line may be broken without its
//! knowing, tracks no further frame.
//!
//! What can go wrong, and what is done about it:
//! - A script was done, and its answer was lost. Each write has a random token, which the record keeps. A script that
//!   comes again with it does nothing.
//! - The store is away or slow. A call ends after a bounded time with [`StoreAway`]; the next ones fail at once, until
//!   a probe in the background has got an answer.
//! - The store takes no writes, since its memory is used up, say. It refuses them one by one, and a probe that writes
//!   finds out when that is over.
//! - Nobody ends a session. Each write renews the record's time to live.
//! - The store loses a record, or is out of reach until the record's time to live is over. A replica that has a copy in
//!   memory makes the record again, with a generation that no other had. It does so for a frame only whose number
//!   follows its copy: another replica may have a newer one.
//! - A session is ended, and copies of it are in the memory of other replicas. A mark stays for as long as these may
//!   live, and no record is made from them meanwhile. A new session may be opened under the same id; each has a random
//!   number of its own, its *birth*, which tells them apart.

mod address;
mod calls;
mod connection;
mod record;
mod scripts;

pub use address::{AddressError, StoreAddress};
pub use calls::{Reply, Store};
pub use connection::StoreAway;
pub use record::{Record, SessionName, Version};
