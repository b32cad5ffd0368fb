//! What all candidates of a frame share: the P previous patches H, and an orthonormal basis Q of their span, found from the
//! small matrix HᵀH.

use crate::tracker::appearance::subspace;
use crate::tracker::linalg::jacobi::Spectrum;

/// The history of a frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedHistory {
    count: usize,
    spectrum: Spectrum,
    eigenvalues: Vec<f64>,
    /// Qᵀh.
    newest: Vec<f64>,
    /// h + the sum of H.
    sum: Vec<f64>,
    sum_norm: f64,
}

impl SharedHistory {
    /// Makes room for up to `slots` patches of length `len`.
    pub fn prepare(&mut self, slots: usize, len: usize) {
        self.eigenvalues.resize(slots, 0.0);
        self.newest.resize(slots, 0.0);
        self.sum.resize(len, 0.0);
    }

    /// Takes the previous patches, newest first, and writes Q (zeros where there is no direction) and then h + the sum of H
    /// to `vectors`, one in `stride` values.
    #[inline(always)]
    pub fn take(&mut self, history: &[&[f32]], vectors: &mut [f32], stride: usize) {
        let (len, count) = (self.sum.len(), history.len());
        let (directions, sum) = vectors.split_at_mut(self.eigenvalues.len() * stride);
        // Q = H R Λ^(-1/2), where HᵀH = R Λ Rᵀ.
        let spectrum = &mut self.spectrum;
        spectrum.solve(count, |i, j| subspace::dot(history[i], history[j]));
        let rank = subspace::dominant(spectrum.values(), count);
        self.eigenvalues.fill(0.0);
        self.newest.fill(0.0);
        for direction in directions.chunks_exact_mut(stride).skip(rank) {
            direction[..len].fill(0.0);
        }
        let directions = directions.chunks_exact_mut(stride).enumerate();
        for ((slot, direction), value) in directions.zip(spectrum.values().take(rank)) {
            self.eigenvalues[slot] = value;
            // H = Q Λ^(1/2) Rᵀ
            self.newest[slot] = value.sqrt() * spectrum.weight(slot, 0);
            let weight = |index| spectrum.weight(slot, index) / value.sqrt();
            subspace::combine(history, weight, &mut direction[..len]);
        }
        self.count = count;
        self.sum.fill(0.0);
        for (index, vector) in history.iter().enumerate() {
            let weight = if index == 0 { 2.0 } else { 1.0 };
            subspace::accumulate(&mut self.sum, vector, weight);
        }
        for (single, value) in sum.iter_mut().zip(&self.sum) {
            *single = *value as f32;
        }
        self.sum_norm = self.sum.iter().map(|value| value * value).sum();
    }

    /// The number of previous patches.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The eigenvalues Λ of HHᵀ that belong to the directions of Q, largest first, then zeros: P values.
    #[inline(always)]
    pub fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// Qᵀh, P values.
    #[inline(always)]
    pub fn newest(&self) -> &[f64] {
        &self.newest
    }

    /// h + the sum of H.
    #[inline(always)]
    pub fn sum(&self) -> &[f64] {
        &self.sum
    }

    /// The squared norm of that.
    pub fn sum_norm(&self) -> f64 {
        self.sum_norm
    }
}

/// The inner product of a vector in double and one in single precision, in eight parts so that the loop vectorises.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f32]) -> f64 {
    let mut parts = [0.0_f64; 8];
    let (a_chunks, a_rest) = a.as_chunks::<8>();
    let (b_chunks, b_rest) = b[..a.len()].as_chunks::<8>();
    for (x, y) in a_chunks.iter().zip(b_chunks) {
        for lane in 0..8 {
            parts[lane] += x[lane] * f64::from(y[lane]);
        }
    }
    let rest = a_rest.iter().zip(b_rest);
    parts.iter().sum::<f64>() + rest.map(|(x, &y)| x * f64::from(y)).sum::<f64>()
}
