//! Creation and advance of sessions, with and without a store.
//!
//! In: parsed requests. Out: estimates, or problems. Whether a session in memory is the newest is asked of the store in
//! [`newest`]; [`advance_session`] tracks and commits.

pub mod advance;
pub mod advance_session;
pub mod first_frame;
pub mod frame_order;
pub mod idempotency;
pub mod newest;
pub mod open_once;
pub mod opening;
pub mod saturation;
pub mod state;
pub mod stored;
pub mod stored_writes;
pub mod video_frames;
pub mod video_place;
pub mod work;
