//! (B) Affine subspaces and (C) the bag of them: what the target has looked like, and what surrounds it.
//!
//! - `model`: what a step asks of either model: `printed`, the paper's, or `single_vector`, the extension.
//! - `bag`: up to K subspaces, a new one every W frames (equation 3, section III-C), and the vectors of the last tracked
//!   frames, of which a subspace is made.
//! - `span`: an affine subspace as coefficients of the few vectors that it is made of, as the single-vector model keeps it.
//! - `augmentation`: rotated copies of the first box's image, which make its subspace.
//! - `background`: vectors of areas beside the target; `mahalanobis`: the metric that their covariance makes.
//! - `color_histogram`: the colours of the target and of what is around it, which `sparse_bins` stores;
//!   `foreground_map`: how likely each pixel of a frame is the target's by its colour.
//! - `bag_matrix` and `point_distance`: the distances of single-vector candidates to all entries (equations 4 to 8 with
//!   n = 1 for the candidate), under that metric.
//!
//! In: feature vectors of length D, one after the other. Out: N x K distances in \[0, 1\], and the products of the
//! candidates with the discriminant's vectors. Vectors are kept quantised to 4 bits a value. A covariance of equal
//! samples gives the plain metric, and a vector that is nothing but rounding after centring counts as the background's
//! mean; nothing here divides by zero.

pub(crate) mod augmentation;
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
