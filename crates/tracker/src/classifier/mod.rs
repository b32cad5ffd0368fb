//! The discriminant: a linear classifier of the target against its surroundings, learned while tracking. All
//! of it is ours, none the paper's.
//!
//! - `ridge`: the classifier's weights, fitted frame by frame by regularised least squares.
//! - `labels`: what it is fitted to, and the areas of the first fit.
//! - `samples`: the training samples of a frame, as inner products of their feature vectors.
//! - `dense_search`: the classifier's scores at every place around the last answer; `sliding_window` computes these
//!   scores as a correlation on one grid of cells, which `channel_planes` brings into lines of one channel each;
//!   `window_score` makes scores of the correlation's products.
//!
//! In: feature vectors of length D, or a grid of cells; labels in \[0, 1\]. Out: scores, about 1 on the target and 0
//! beside it but not bounded; maxima as particles. A vector that is nothing but rounding has the score 0; samples whose
//! squares underflow leave the weights finite.

pub(crate) mod channel_planes;
pub(crate) mod dense_search;
pub(crate) mod labels;
pub(crate) mod ridge;
pub(crate) mod samples;
pub(crate) mod sliding_window;
pub(crate) mod window_score;
