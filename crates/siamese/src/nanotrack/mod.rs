//! NanoTrack (Chu): a backbone of MobileNetV3 describes the target once and a search area in each frame; a head
//! compares both, and says for each place of a grid whether the target is there and how far its edges are.
//!
//! - `crop`: the picture that the network gets, out of a frame.
//! - `decode`: from the head's answer to a box.
//! - `tracker`: both networks as an [`Expert`](bagtrack_tracker::Expert).
//!
//! In: frames and boxes in their pixels. Out: boxes and scores. What can go wrong: files that are no NanoTrack, which
//! are refused when they are loaded.

mod crop;
mod decode;
pub(crate) mod tracker;
