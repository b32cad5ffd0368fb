//! A second opinion: a tracker of another kind, which fails on other frames than the particle filter.
//!
//! - `opinion`: the trait [`Expert`](opinion::Expert), and what an expert says of a frame.
//! - `second_opinion`: what a session keeps of its expert, and where the expert looks next.
//! - `fusion`: the answer that both give together, and its score.
//!
//! In: a frame, the filter's answer and score, and the expert's template and place. Out: a box, a score, and whether
//! the filter goes on from the expert's place. The expert itself comes from outside of this crate: it may be a network
//! with weights of megabytes, which many sessions share. Nothing fails.

pub(crate) mod fusion;
pub(crate) mod opinion;
pub(crate) mod second_opinion;
