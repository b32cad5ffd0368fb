//! From areas of a frame to feature vectors: what the tracker compares.
//!
//! In: a [`Frame`](crate::image::frame::Frame) and particles, in working pixels. Out: for each
//! particle a vector of D `f32` values, one after the other. These are H₁ x H₂ gray values in [0, 1] (section III-B),
//! or H₁ x H₂ cells of twelve values: nine gradient directions in [0, 0.4], two of chroma and a gray value of mean 0.
//!
//! | file | holds | whose |
//! |---|---|---|
//! | [`gray`] | gray patches | paper |
//! | [`extractor`] | [`Extractor`](extractor::Extractor): from particles to vectors of either kind | ours |
//! | [`hog`] | gradient histograms, a module of its own | ours |
//! | [`quantized`] | vectors in 4 or 10 bits a value, as the state keeps them | ours |
//!
//! What can go wrong: nothing fails. Areas need finite positions and sides above 0. They may reach over the frame's
//! edge: gray patches continue the edge's pixels; in gradient histograms the pixels beyond the edge are black and have
//! no gradient. Areas outside the window that was computed for the frame are treated as if the frame ended there.

pub(crate) mod extractor;
pub(crate) mod gray;
pub(crate) mod hog;
pub(crate) mod quantized;
