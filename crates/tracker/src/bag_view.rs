//! The bag for people to look at: each entry as its subspace, and each vector of a subspace as pictures.

use crate::features::hog::channels::{CHANNELS, CHROMA, DIRECTIONS, GRAY};
use crate::grassmann::subspace::AffineSubspace;
use crate::params::table::{Features, Params};

/// One entry of the bag: an affine subspace (equation 1).
#[derive(Debug, Clone, PartialEq)]
pub struct BagEntry {
    /// The mean μ.
    pub mean: VectorView,
    /// The columns of the basis U, the dominant one first.
    pub basis: Vec<VectorView>,
}

/// A feature vector as pictures: one value for each cell, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct VectorView {
    /// Cells across.
    pub columns: u32,
    /// Cells down.
    pub rows: u32,
    /// The gray values.
    pub gray: Vec<f32>,
    /// Blue and red chroma; 0 without colour, and none with gray features.
    pub chroma: Option<[Vec<f32>; 2]>,
    /// The strength of the gradients: the sum over their directions. None with gray features.
    pub gradient: Option<Vec<f32>>,
}

impl BagEntry {
    /// The view of `subspace`, an entry of a tracker with `params`.
    pub(crate) fn of(subspace: &AffineSubspace, params: &Params) -> Self {
        Self {
            mean: VectorView::of(&subspace.mean, params),
            basis: subspace
                .basis()
                .map(|it| VectorView::of(it, params))
                .collect(),
        }
    }
}

impl VectorView {
    fn of(vector: &[f32], params: &Params) -> Self {
        let has_gradients = params.features == Features::Gradients;
        let cells = || vector.chunks_exact(CHANNELS);
        let channel = |lane: usize| cells().map(|cell| cell[lane]).collect::<Vec<f32>>();
        let strength = |cell: &[f32]| cell[..DIRECTIONS].iter().sum();
        Self {
            columns: params.patch_width,
            rows: params.patch_height,
            gray: match has_gradients {
                true => channel(GRAY),
                false => vector.to_vec(),
            },
            chroma: has_gradients.then(|| CHROMA.map(channel)),
            gradient: has_gradients.then(|| cells().map(strength).collect()),
        }
    }
}
