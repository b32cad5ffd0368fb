//! A store in Redis or Valkey.
//!
//! In: the calls of [`SessionStore`](super::session_store::SessionStore). Out: their outcomes. A record is a hash with
//! the session's id in its key, and each call is one [script](scripts), which Redis runs as a whole. A state goes there
//! in a transaction with the script that commits it.
//!
//! What can go wrong, and what is done about it:
//! - A script was done, and its answer was lost. Each write has a random token, which the record keeps. A script that
//!   is sent again with the same token does nothing.
//! - The server is away or slow. A call ends after a bounded time with
//!   [`StoreUnavailable`](super::session_store::StoreUnavailable); the next ones fail at once, until a probe in the
//!   background has got an answer.
//! - The server takes no writes, since its memory is used up, say. It refuses them one by one, and a probe that writes
//!   finds out when that is over.

mod address;
mod calls;
mod connection;
mod scripts;

pub use address::{RedisAddress, RedisAddressError};
pub use calls::RedisStore;
pub use scripts::{NewHash, ScriptServer};
