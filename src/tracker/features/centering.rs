//! Centering: the background's mean is subtracted from feature vectors while they are in the cache.

use pulp::{Arch, Simd};

use crate::tracker::linalg::vector_ops;

/// Subtracts a mean from feature vectors and collects their squared lengths.
pub(crate) struct Centering<'a> {
    /// The mean; none is subtracted where it is empty.
    pub mean: &'a [f32],
    /// The squared length of each vector is appended here.
    pub squares: &'a mut Vec<f32>,
}

impl Centering<'_> {
    /// Centers one vector.
    #[inline(always)]
    pub fn apply<S: Simd>(&mut self, _: S, vector: &mut [f32]) {
        vector_ops::add(vector, -1.0, self.mean);
        self.squares.push(vector_ops::dot(vector, vector));
    }
}

/// Centers a vector, where there is one and that is asked for.
#[inline(always)]
pub(crate) fn center<S: Simd>(simd: S, centering: &mut Option<Centering<'_>>, vector: &mut [f32]) {
    if let Some(centering) = centering
        && !vector.is_empty()
    {
        centering.apply(simd, vector);
    }
}

/// Centers all `vectors`, each of length `len`.
#[pulp::with_simd(center_all = Arch::new())]
#[inline(always)]
pub(crate) fn center_all_simd<S: Simd>(
    simd: S,
    vectors: &mut [f32],
    len: usize,
    centering: &mut Centering<'_>,
) {
    for vector in vectors.chunks_exact_mut(len) {
        centering.apply(simd, vector);
    }
}
