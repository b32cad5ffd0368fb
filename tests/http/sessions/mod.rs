//! A session from its first frame to its end, and tracking without one.

pub mod bag;
pub mod drawn;
pub mod expiry;
pub mod flow;
pub mod idempotency;
pub mod identity;
pub mod replay;
pub mod second_opinion;
pub mod snapshots;
pub mod stateless;
pub mod targets;
pub mod targets_carried;
