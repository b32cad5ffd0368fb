//! A store in a folder of this machine, for one process.
//!
//! In: the calls of [`SessionStore`](super::session_store::SessionStore). Out: their outcomes. A session is a
//! [row](row) and its state in an embedded database (fjall, a log-structured merge tree with a journal). One thread
//! does all calls: it takes those that wait, runs their [rules] in one transaction, and answers when the transaction is
//! written.
//!
//! What can go wrong, and what is done about it:
//! - The process is killed. The journal is written before each answer, so nothing that was answered is lost.
//! - The power goes. What was synced stays: [`Durability`] says when that is.
//! - The last write is torn. The database drops it, and the log says how many bytes.
//! - The files are damaged. Opening them fails with a text that names the folder, or the one session that is hit is
//!   told as unreadable. Each block and each write has a checksum.
//! - The disk is nearly full. Further sessions are refused, so that there is room for the frames of those in it.
//! - The disk is full, or writing fails otherwise. The calls are answered
//!   [`StoreUnavailable`](super::session_store::StoreUnavailable), nothing of them counts, and the database is opened
//!   again until it takes writes.
//! - The disk hangs. A call has no answer when its time is over: it is not done later unless it is being written just
//!   then, and the store is not ready until a write succeeds.
//! - Nobody ends a session. Rows whose time is over are swept, and their space is given back.
//! - The wall clock is set. [What is in the folder](time) expires by the monotonic one.
//! - Two processes have the same folder. The second is refused: the database locks it.

mod calls;
mod database;
mod durability;
mod folder;
mod row;
mod rules;
mod shares;
mod time;
mod writer;

pub use calls::FileStore;
pub use database::OpenError as FileStoreError;
pub use durability::{Durability, DurabilityError};
#[cfg(fuzzing)]
pub use row::{record_of_row, row_and_state};
