//! Histograms of oriented gradients, with the cells' chroma and gray value, for many areas of one frame.
//!
//! In: a window of a frame and areas in it, in pixels of that frame. Out: for each area H₁ x H₂ cells of
//! [`CHANNELS`](channels::CHANNELS) `f32` values.
//!
//! | file | holds |
//! |---|---|
//! | [`gradient`], [`binning`] | a row of gradients, and its row of the integral image |
//! | [`integral`] | the integral image, which cells are sums of |
//! | [`sample_coords`] | coordinates in the integral image |
//! | [`cells`], [`block_norm`] | the cells of one area, and the normalisation of their directions |
//! | [`descriptor`] | the feature vectors of many areas |
//! | [`channels`] | the order of the channels |
//!
//! What can go wrong: nothing fails. Outside the window there is no gradient, and black.

pub(crate) mod binning;
pub(crate) mod block_norm;
pub(crate) mod cells;
pub(crate) mod channels;
pub(crate) mod descriptor;
pub(crate) mod gradient;
pub(crate) mod integral;
pub(crate) mod sample_coords;
