//! How far the tracker trusts its own answer. All of it is ours, none the paper's.
//!
//! - `score`: the probability, in \[0, 1\], that the box overlaps the target by half or more, and the status.
//! - `update_gate`: whether the target is lost, and whether a frame may update the models.
//!
//! In: what the chosen candidate says of itself (its distances, its classifier score, its scale), and statistics of the
//! frames before. Out: score, status, and two decisions. Nothing fails. Without a discriminant the score only orders
//! frames and is no probability.

pub(crate) mod score;
pub(crate) mod update_gate;
