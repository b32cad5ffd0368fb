//! The one large computation of a frame: all inner products, as a single matrix product.
//!
//! Nothing of size D x (P + 1) is decomposed for a candidate. All candidates of a frame share the P previous
//! patches H. With an orthonormal basis Q of their span, found once a frame from the small matrix HᵀH, the inner
//! products of a candidate with Q, with the sum of H and with the vectors in the bag say everything about its
//! affine subspace and its distances.
//!
//! The hazard is cancellation: candidate and history are nearly the same vector, and what matters is the
//! difference. In single precision it would be gone, so everything is in double precision.

use pulp::Simd;

use super::eigen::Spectrum;
use super::subspace::{self, AffineSubspace};
use super::{Params, kernel};

/// The inner products of (candidates, Q, the sum of H) with (Q, the sum of H, the bag).
#[derive(Debug, Clone, Default)]
pub(super) struct Products {
    len: usize,
    candidates: usize,
    slots: usize,
    stride: usize,
    /// The candidates, then Q (P slots, zero where there is no direction), then the sum of H: one vector a row.
    left: Vec<f64>,
    /// Where the first of them begins.
    left_first: usize,
    /// Q, the sum of H, the means of the bag's entries, their first basis vectors, their second and so on: one vector a
    /// column.
    right: Vec<f64>,
    right_first: usize,
    /// For each vector of `left` its products with those of `right`.
    out: Vec<f64>,
    /// The number of vectors of `right`.
    width: usize,
    spectrum: Spectrum,
    norms: Vec<f64>,
    history_eigenvalues: Vec<f64>,
    history_len: usize,
    sum_norm: f64,
}

impl Products {
    /// Makes room for these parameters.
    pub fn prepare(&mut self, params: &Params) {
        self.len = params.feature_len();
        self.candidates = params.particles as usize;
        self.slots = params.history as usize;
        self.stride = params.basis_dim as usize + 1;
        let rows = self.candidates + self.slots + 1;
        self.left_first = kernel::align(&mut self.left, rows * self.len);
        self.left.resize(self.left_first + rows * self.len, 0.0);
        self.norms.resize(self.candidates, 0.0);
        self.history_eigenvalues.resize(self.slots, 0.0);
    }

    /// The feature vector of candidate `index`, to be filled in.
    pub fn candidate_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.left[self.left_first + index * self.len..][..self.len]
    }

    /// The feature vectors of all candidates, one after the other, to be filled in.
    pub fn candidates_mut(&mut self) -> &mut [f64] {
        &mut self.left[self.left_first..][..self.candidates * self.len]
    }

    /// The feature vector of candidate `index`.
    pub fn candidate(&self, index: usize) -> &[f64] {
        &self.left[self.left_first + index * self.len..][..self.len]
    }

    /// Takes the vectors of the bag's entries.
    pub fn set_bag<'a>(&mut self, entries: impl ExactSizeIterator<Item = &'a AffineSubspace>) {
        let first = self.slots + 1;
        let columns = first + entries.len() * self.stride;
        self.right_first = kernel::align(&mut self.right, columns * self.len);
        self.right
            .resize(self.right_first + columns * self.len, 0.0);
        let (count, len) = (entries.len(), self.len);
        let right = &mut self.right[self.right_first..];
        for (k, entry) in entries.enumerate() {
            let vectors = entry.mean.chunks_exact(len).chain(entry.basis());
            for (column, vector) in vectors.enumerate() {
                let target = &mut right[(first + column * count + k) * len..][..len];
                for (target, &value) in target.iter_mut().zip(vector) {
                    *target = f64::from(value);
                }
            }
        }
        let rows = (self.left.len() - self.left_first) / self.len;
        self.width = columns;
        self.out.resize(columns * rows, 0.0);
    }

    /// Computes all products of the candidates with `history`, the previous patches, and the bag.
    #[inline(always)]
    pub fn compute<S: Simd>(&mut self, simd: S, history: &[&[f32]]) {
        self.factor(history);
        let (len, columns) = (self.len, self.width);
        let left = &self.left[self.left_first..];
        let right = &self.right[self.right_first..];
        kernel::multiply(simd, left, right, len, columns, &mut self.out);
        for index in 0..self.candidates {
            self.norms[index] = norm_squared(self.candidate(index));
        }
    }

    /// Q = H R Λ^(-1/2), where HᵀH = R Λ Rᵀ, and the sum of H.
    #[inline(always)]
    fn factor(&mut self, history: &[&[f32]]) {
        let (len, count) = (self.len, history.len());
        let shared =
            &mut self.left[self.left_first + self.candidates * len..][..(self.slots + 1) * len];
        shared.fill(0.0);
        let (directions, sum) = shared.split_at_mut(self.slots * len);
        for vector in history {
            subspace::accumulate(sum, vector, 1.0);
        }
        let spectrum = &mut self.spectrum;
        spectrum.solve(count, |i, j| subspace::dot(history[i], history[j]));
        let rank = subspace::dominant(spectrum.values(), count);
        self.history_eigenvalues.fill(0.0);
        for (slot, value) in spectrum.values().take(rank).enumerate() {
            self.history_eigenvalues[slot] = value;
            let direction = &mut directions[slot * len..(slot + 1) * len];
            for (index, vector) in history.iter().enumerate() {
                let weight = spectrum.weight(slot, index) / value.sqrt();
                subspace::accumulate(direction, vector, weight);
            }
        }
        self.history_len = count;
        self.sum_norm = norm_squared(sum);
        self.right[self.right_first..][..(self.slots + 1) * len].copy_from_slice(shared);
    }

    /// The products of candidate `index`: with Q (P slots), with the sum of H, with the bag.
    pub fn of_candidate(&self, index: usize) -> Row<'_> {
        self.row(index)
    }

    /// The products of direction `slot` of Q.
    pub fn of_direction(&self, slot: usize) -> Row<'_> {
        self.row(self.candidates + slot)
    }

    /// The products of the sum of H.
    pub fn of_sum(&self) -> Row<'_> {
        self.row(self.candidates + self.slots)
    }

    #[inline(always)]
    fn row(&self, index: usize) -> Row<'_> {
        let all = &self.out[index * self.width..(index + 1) * self.width];
        let (with_directions, rest) = all.split_at(self.slots);
        Row {
            with_directions,
            with_sum: rest[0],
            with_bag: &rest[1..],
        }
    }

    /// ‖v‖² of candidate `index`.
    pub fn norm(&self, index: usize) -> f64 {
        self.norms[index]
    }

    /// The squared norm of the sum of H.
    pub fn sum_norm(&self) -> f64 {
        self.sum_norm
    }

    /// The eigenvalues Λ of HHᵀ that belong to the directions of Q, largest first, then zeros: P values.
    pub fn history_eigenvalues(&self) -> &[f64] {
        &self.history_eigenvalues
    }

    /// The number of previous patches.
    pub fn history_len(&self) -> usize {
        self.history_len
    }
}

/// The inner products of one vector.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<'a> {
    /// With the directions of Q, P slots.
    pub with_directions: &'a [f64],
    /// With the sum of H.
    pub with_sum: f64,
    /// With the means of the bag's entries, with their first basis vectors, and so on to the n-th (0 for those that an
    /// entry does not have).
    pub with_bag: &'a [f64],
}

#[inline(always)]
fn norm_squared(vector: &[f64]) -> f64 {
    let mut parts = [0.0_f64; 8];
    let (chunks, rest) = vector.as_chunks::<8>();
    for chunk in chunks {
        for lane in 0..8 {
            parts[lane] += chunk[lane] * chunk[lane];
        }
    }
    parts.iter().sum::<f64>() + rest.iter().map(|value| value * value).sum::<f64>()
}
