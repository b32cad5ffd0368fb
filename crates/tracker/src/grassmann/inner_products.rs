//! All inner products of a frame, in double precision, as one matrix product.

use nalgebra::{SMatrix, SVector, SimdValue};
use pulp::Simd;

use crate::grassmann::subspace::{self, AffineSubspace};
use crate::grassmann::{LANES, Lanes};
use crate::linalg::gemm;
use crate::params::table::Params;

/// Values in a cache line. Vectors lie an extra one apart: 1024 values (8 KB) after another vector, a vector would share
/// its places in the first cache.
const LINE: usize = 8;

/// The inner products of [H, v] with [μ₁, F₁, …, μ_K, F_K, H], for a batch of [`LANES`] vectors v.
#[derive(Debug, Clone, Default)]
pub(crate) struct InnerProducts {
    /// D.
    len: usize,
    /// From one vector to the next; what is beyond D is zero.
    stride: usize,
    /// P.
    patches: usize,
    /// n + 1: the mean and the basis vectors of an entry, zero where it has fewer.
    per_entry: usize,
    /// K, or fewer while the bag grows.
    entries: usize,
    /// The bag, H (zero where there are fewer previous patches than P), the batch.
    vectors: Vec<f64>,
    /// A row for each of H, a column for each of the bag's vectors and of H.
    of_history: Vec<f64>,
    /// A row for each of the bag's vectors and of H, a column for each of the batch.
    of_batch: Vec<f64>,
    /// ‖v‖² of the batch.
    squares: [f64; LANES],
}

impl InnerProducts {
    /// Takes the sizes of these parameters. The bag must be set again.
    pub fn prepare(&mut self, params: &Params) {
        let (patches, per_entry) = (params.history as usize, params.basis_dim as usize + 1);
        if (self.len, self.patches, self.per_entry) != (params.feature_len(), patches, per_entry) {
            self.len = params.feature_len();
            self.stride = self.len.next_multiple_of(LINE) + LINE;
            (self.patches, self.per_entry) = (patches, per_entry);
            self.entries = 0;
        }
    }

    fn columns(&self) -> usize {
        self.entries * self.per_entry + self.patches
    }

    /// Takes the vectors of the bag's entries.
    pub fn set_bag<'a>(&mut self, bag: impl ExactSizeIterator<Item = &'a AffineSubspace>) {
        if bag.len() != self.entries {
            self.entries = bag.len();
            self.vectors.clear();
            self.vectors
                .resize((self.columns() + LANES) * self.stride, 0.0);
            self.of_history.resize(self.patches * self.columns(), 0.0);
            self.of_batch.resize(self.columns() * LANES, 0.0);
        }
        let rows = self.vectors.chunks_exact_mut(self.per_entry * self.stride);
        for (entry, rows) in bag.zip(rows) {
            let mut rows = rows.chunks_exact_mut(self.stride);
            for (vector, row) in std::iter::once(entry.mean())
                .chain(entry.basis())
                .zip(&mut rows)
            {
                widen(vector, row);
            }
            rows.for_each(|row| row.fill(0.0));
        }
    }

    /// Takes the previous patches `history`, and multiplies them with all.
    ///
    /// # Panics
    /// If there is no bag, no previous patch or more than P, or one that is not of length D.
    pub fn set_history<'a>(&mut self, mut history: impl ExactSizeIterator<Item = &'a [f32]>) {
        assert!(self.entries > 0, "a bag was set");
        assert!(
            (1..=self.patches).contains(&history.len()),
            "1 to P previous patches"
        );
        let (stride, columns) = (self.stride, self.columns());
        let all = &mut self.vectors[..columns * stride];
        let bag = self.entries * self.per_entry * stride;
        for row in all[bag..].chunks_exact_mut(stride) {
            match history.next() {
                Some(vector) => {
                    assert_eq!(vector.len(), self.len, "a patch of D values");
                    widen(vector, row);
                }
                None => row.fill(0.0),
            }
        }
        gemm::inner_products(&all[bag..], all, stride, columns, &mut self.of_history);
    }

    /// Multiplies a batch of 1 to [`LANES`] candidates, of length D one after the other, with all. Where there are
    /// fewer, the last products mean nothing.
    #[inline(always)]
    pub fn multiply<S: Simd>(&mut self, simd: S, candidates: &[f32]) {
        let (stride, columns) = (self.stride, self.columns());
        let (all, batch) = self.vectors.split_at_mut(columns * stride);
        let candidates = candidates.chunks_exact(self.len);
        for ((i, vector), row) in candidates.enumerate().zip(batch.chunks_exact_mut(stride)) {
            widen(vector, row);
            self.squares[i] = subspace::dot(vector, vector);
        }
        gemm::multiply(
            simd,
            all,
            &batch[..LANES * stride],
            stride,
            LANES,
            &mut self.of_batch,
        );
    }

    /// Vᵀ x of the batch, x being vector `column` of the bag and H; zero beyond V's P + 1 columns.
    #[inline(always)]
    fn with<const M: usize>(&self, column: usize) -> SVector<Lanes, M> {
        let mut products = SVector::repeat(Lanes::splat(0.0));
        products[0] = Lanes::from(self.of_batch.as_chunks().0[column]);
        for i in 0..self.patches {
            products[i + 1] = Lanes::splat(self.of_history[i * self.columns() + column]);
        }
        products
    }

    /// VᵀV of the batch; zero beyond its P + 1 rows and columns.
    #[inline(always)]
    pub fn gram<const M: usize>(&self) -> SMatrix<Lanes, M, M> {
        let mut gram = SMatrix::<Lanes, M, M>::repeat(Lanes::splat(0.0));
        gram[(0, 0)] = Lanes::from(self.squares);
        for j in 0..self.patches {
            let products = self.with::<M>(self.entries * self.per_entry + j);
            gram[(j + 1, 0)] = products[0];
            gram.set_column(j + 1, &products);
        }
        gram
    }

    /// Vᵀμₖ of the batch and entry `k`.
    #[inline(always)]
    pub fn with_mean<const M: usize>(&self, k: usize) -> SVector<Lanes, M> {
        self.with(k * self.per_entry)
    }

    /// VᵀFₖ of the batch and entry `k`.
    #[inline(always)]
    pub fn with_basis<const M: usize, const N: usize>(&self, k: usize) -> SMatrix<Lanes, M, N> {
        let mut products = SMatrix::<Lanes, M, N>::repeat(Lanes::splat(0.0));
        for j in 1..self.per_entry {
            products.set_column(j - 1, &self.with::<M>(k * self.per_entry + j));
        }
        products
    }
}

/// Writes a vector to the beginning of a row.
#[inline(always)]
fn widen(vector: &[f32], row: &mut [f64]) {
    for (out, &value) in row.iter_mut().zip(vector) {
        *out = f64::from(value);
    }
}
