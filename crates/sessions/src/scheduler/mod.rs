//! Which work runs when: the queue before the workers, the turns of clients, and the bounds of one request's work.
//!
//! In: work on frames, with the client that it is for. Out: its result, after it ran on a worker thread.
//!
//! What can go wrong: there is more work than the workers do ([`Admission::enter`](admission::Admission::enter) refuses
//! it), one client sends more work than its share ([`fair_queue`] still gives the others their turns, and requests that
//! wait too long are [refused](controlled_delay)), or one request costs too much ([`work_limit`] stops its work between
//! two frames). Work whose client has gone keeps its permits until it has ended.

pub(crate) mod admission;
pub(crate) mod budget;
mod controlled_delay;
pub(crate) mod executor;
pub(crate) mod fair_queue;
pub(crate) mod flows;
#[cfg(all(test, feature = "shuttle"))]
mod interleavings;
pub(crate) mod queue_permit;
mod side_by_side;
pub(crate) mod work_limit;
