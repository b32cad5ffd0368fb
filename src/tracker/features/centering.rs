//! Vectors with the background's mean taken off, and their squared lengths.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::linalg::vector_ops;

/// What is taken off, and where the squared lengths go.
pub(crate) struct Centering<'a> {
    /// Where it is empty nothing is taken off.
    pub mean: &'a [f32],
    pub squares: &'a mut Vec<f32>,
}

/// [`Centering::apply_to_all`], to be compiled for the instructions that this machine has.
struct ApplyToAll<'a> {
    centering: Centering<'a>,
    vectors: &'a mut [f32],
    len: usize,
}

impl WithSimd for ApplyToAll<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for vector in self.vectors.chunks_exact_mut(self.len) {
            self.centering.apply(simd, vector);
        }
    }
}

impl Centering<'_> {
    /// Takes the mean off a vector and appends its squared length.
    #[inline(always)]
    pub fn apply<S: Simd>(&mut self, _: S, vector: &mut [f32]) {
        vector_ops::add(vector, -1.0, self.mean);
        self.squares.push(vector_ops::dot(vector, vector));
    }

    /// The same for several vectors of length `len`.
    pub fn apply_to_all(self, vectors: &mut [f32], len: usize) {
        Arch::new().dispatch(ApplyToAll {
            centering: self,
            vectors,
            len,
        });
    }
}
