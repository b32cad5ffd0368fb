//! Histograms of oriented gradients, with the cells' chroma and gray value, for many areas of one frame.
//!
//! In: a window of a frame and areas in it, in pixels of that frame. Out: for each area H₁ x H₂ cells of
//! [`CHANNELS`](channels::CHANNELS) `f32` values.
//!
//! Read [`gradient`], [`binning`] and [`integral`] (once a frame), then [`cells`], [`block_norm`] and [`descriptor`]
//! (for each area). [`channels`] has the order of a cell's values.
//!
//! What can go wrong: nothing fails. Pixels outside the window are black and have no gradient.

pub(crate) mod binning;
pub(crate) mod block_norm;
pub(crate) mod cells;
pub(crate) mod channels;
pub(crate) mod descriptor;
pub(crate) mod gradient;
pub(crate) mod integral;
pub(crate) mod sample_coords;
