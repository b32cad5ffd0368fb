//! (B) Affine subspaces and (C) the bag of them: what the target has looked like, and what surrounds it.
//!
//! | file | holds | whose |
//! |---|---|---|
//! | `bag` | up to K subspaces, a new one every W frames (equation 3), and the last tracked vectors, P at most | paper |
//! | `printed` | the appearance as printed: its subspaces and their comparison are in `grassmann/` | paper |
//! | `model` | what a step asks of either appearance, `printed` or `single_vector` | ours |
//! | `single_vector` | the appearance whose candidates are one vector each | ours |
//! | `span` | the entries of its bag: subspaces as coefficients of the few vectors that they are made of | ours |
//! | `bag_matrix`, `point_distance` | the distances to its entries (equations 4 to 8 with n = 1 for the candidate) | ours |
//! | `background`, `mahalanobis` | vectors of areas beside the target; the metric that their covariance makes | ours |
//! | `color_histogram`, `sparse_bins` | the colours of the target and around it; how a snapshot stores them | ours |
//! | `foreground_map` | how likely each pixel of a frame is the target's by its colour | ours |
//!
//! In: feature vectors of length D, one after the other. Out: N x K distances in \[0, 1\], and the products of the
//! candidates with the discriminant's vectors. Vectors are kept quantised to 4 bits a value. A covariance of equal
//! samples gives the plain metric, and a vector of which centring leaves nothing but rounding counts as the
//! background's mean; nothing here divides by zero.

pub(crate) mod background;
pub(crate) mod bag;
pub(crate) mod bag_matrix;
pub(crate) mod color_histogram;
pub(crate) mod foreground_map;
pub(crate) mod mahalanobis;
pub(crate) mod model;
pub(crate) mod point_distance;
pub(crate) mod printed;
pub(crate) mod single_vector;
pub(crate) mod span;
pub(crate) mod sparse_bins;
