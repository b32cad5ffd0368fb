//! (A) Where the target may be: particles, how they are drawn, and what is known of a place before it is looked at.
//!
//! | file | holds | whose |
//! |---|---|---|
//! | `particles` | a particle z = (x, y, s) in working pixels, and the bounds that every particle is clamped to | paper |
//! | `resampling` | the particle filter: resampling by weight and Brownian motion (section III-A) | paper |
//! | `random` | the generator of a frame's draws | ours |
//! | `search` | the search around the last answer: how wide, how many particles, the prior on the displacement | ours |
//! | `proposal` | draws around the last answer and, in a second round, around the best of the first | ours |
//! | `global_motion` | the displacement of the whole image between two frames | ours |
//! | `change_test` | whether anything has come to a place since the target was last seen | ours |
//! | `last_seen`, `joint_integral` | the frame that the change test compares with, and its sums | ours |
//! | `orientation` | the target's in-plane rotation | ours |
//!
//! In: the last particles and weights, or the last answer; the frame. Out: particles, log-priors (natural logarithms,
//! 0 at the likeliest place), displacements in working pixels, angles in radians. Nothing here fails: every particle
//! is clamped to its bounds, and a measurement that is not certain answers that nothing moved.

pub(crate) mod change_test;
pub(crate) mod global_motion;
pub(crate) mod joint_integral;
pub(crate) mod last_seen;
pub(crate) mod orientation;
pub(crate) mod particles;
pub(crate) mod proposal;
pub(crate) mod random;
pub(crate) mod resampling;
pub(crate) mod search;
