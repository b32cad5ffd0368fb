//! All inner products of a frame, in double precision, as one matrix product.

use nalgebra::{SMatrix, SVector, SimdValue};
use pulp::{Arch, Simd, WithSimd};

use crate::tracker::appearance::subspace::{self, AffineSubspace};
use crate::tracker::grassmann::Lanes;
use crate::tracker::linalg::acos::LANES;
use crate::tracker::linalg::{gemm, scratch};
use crate::tracker::params::table::Params;

/// Values in a cache line. Vectors begin at one, and lie an extra one apart: 1024 values (8 KB) after another vector, a
/// vector would share its places in the first cache. Together this is worth 40 % of the product's time.
const LINE: usize = 8;

/// Candidates that are multiplied together: more would not stay in the second cache beside the bag.
const BATCH: usize = 8;

/// The inner products of [H, v₁, …, v_N] with [μ₁, F₁, …, μ_K, F_K, H].
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
    /// N, or more to make whole groups.
    candidates: usize,
    /// The bag, H (zero where there are fewer previous patches than P), some of the candidates.
    vectors: Vec<f64>,
    /// Where the first of them begins.
    first: usize,
    /// A row for each of the bag's vectors and of H, a column for each candidate.
    products: Vec<f64>,
    /// A row for each of H, a column for each of the bag's vectors and of H.
    of_history: Vec<f64>,
    /// ‖v‖² of each candidate.
    squares: Vec<f64>,
}

impl InnerProducts {
    /// Makes room for these parameters. The bag must be set again.
    pub fn prepare(&mut self, params: &Params) {
        self.len = params.feature_len();
        self.stride = self.len.next_multiple_of(LINE) + LINE;
        self.patches = params.history as usize;
        self.per_entry = params.basis_dim as usize + 1;
        self.candidates = (params.particles as usize).next_multiple_of(LANES);
        self.entries = 0;
    }

    fn columns(&self) -> usize {
        self.entries * self.per_entry + self.patches
    }

    /// Takes the vectors of the bag's entries.
    pub fn set_bag<'a>(&mut self, bag: impl ExactSizeIterator<Item = &'a AffineSubspace>) {
        if bag.len() != self.entries {
            self.entries = bag.len();
            let values = (self.columns() + BATCH) * self.stride;
            self.first = scratch::aligned_zeros(&mut self.vectors, values);
            self.products.resize(self.columns() * self.candidates, 0.0);
            self.of_history.resize(self.patches * self.columns(), 0.0);
        }
        let rows = self.vectors[self.first..].chunks_exact_mut(self.per_entry * self.stride);
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

    /// Multiplies `candidates`, of length D one after the other, and the previous patches `history` with all.
    ///
    /// # Panics
    /// If there is no bag, no previous patch or more than P, or one that is not of length D.
    pub fn compute(&mut self, candidates: &[f32], history: &[&[f32]]) {
        assert!(self.entries > 0, "a bag was set");
        assert!(
            (1..=self.patches).contains(&history.len()),
            "1 to P previous patches"
        );
        let (stride, columns) = (self.stride, self.columns());
        let (all, batch) = self.vectors[self.first..].split_at_mut(columns * stride);
        let bag = self.entries * self.per_entry;
        for (index, row) in all[bag * stride..].chunks_exact_mut(stride).enumerate() {
            match history.get(index) {
                Some(vector) => {
                    assert_eq!(vector.len(), self.len, "a patch of D values");
                    widen(vector, row);
                }
                None => row.fill(0.0),
            }
        }
        let history = &all[bag * stride..];
        gemm::inner_products(history, all, stride, columns, &mut self.of_history);
        self.squares.clear();
        for (index, candidates) in candidates.chunks(BATCH * self.len).enumerate() {
            let rows = &mut batch[..candidates.len() / self.len * stride];
            Arch::new().dispatch(Widen {
                vectors: candidates,
                len: self.len,
                rows,
                squares: &mut self.squares,
            });
            let products = &mut self.products[index * BATCH..];
            gemm::inner_products(all, rows, stride, self.candidates, products);
        }
        self.squares.resize(self.candidates, 0.0);
    }

    /// Vᵀ x of the candidates of a group, x being vector `column` of the bag and H; zero beyond V's P + 1 columns.
    #[inline(always)]
    fn with<const M: usize>(&self, group: usize, column: usize) -> SVector<Lanes, M> {
        let mut products = SVector::repeat(Lanes::splat(0.0));
        let row = &self.products[column * self.candidates..];
        products[0] = lanes(row, group);
        for i in 0..self.patches {
            products[i + 1] = Lanes::splat(self.of_history[i * self.columns() + column]);
        }
        products
    }

    /// VᵀV of the candidates of a group; zero beyond its P + 1 rows and columns.
    #[inline(always)]
    pub fn gram<const M: usize>(&self, group: usize) -> SMatrix<Lanes, M, M> {
        let mut gram = SMatrix::<Lanes, M, M>::repeat(Lanes::splat(0.0));
        gram[(0, 0)] = lanes(&self.squares, group);
        for j in 0..self.patches {
            let products = self.with::<M>(group, self.entries * self.per_entry + j);
            gram[(j + 1, 0)] = products[0];
            gram.set_column(j + 1, &products);
        }
        gram
    }

    /// Vᵀμₖ of the candidates of a group and entry `k`.
    #[inline(always)]
    pub fn with_mean<const M: usize>(&self, group: usize, k: usize) -> SVector<Lanes, M> {
        self.with(group, k * self.per_entry)
    }

    /// VᵀFₖ of the candidates of a group and entry `k`.
    #[inline(always)]
    pub fn with_basis<const M: usize, const N: usize>(
        &self,
        group: usize,
        k: usize,
    ) -> SMatrix<Lanes, M, N> {
        let mut products = SMatrix::<Lanes, M, N>::repeat(Lanes::splat(0.0));
        for j in 1..self.per_entry {
            products.set_column(j - 1, &self.with::<M>(group, k * self.per_entry + j));
        }
        products
    }
}

/// The values of the candidates of a group.
#[inline(always)]
fn lanes(values: &[f64], group: usize) -> Lanes {
    Lanes::from(values.as_chunks::<LANES>().0[group])
}

/// Writes vectors of length `len` to as many rows, in double precision, and their squared lengths to `squares`;
/// compiled for the instructions that this machine has.
struct Widen<'a> {
    vectors: &'a [f32],
    len: usize,
    rows: &'a mut [f64],
    squares: &'a mut Vec<f64>,
}

impl WithSimd for Widen<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let stride = self.rows.len() / (self.vectors.len() / self.len);
        let rows = self.rows.chunks_exact_mut(stride);
        for (vector, row) in self.vectors.chunks_exact(self.len).zip(rows) {
            widen(vector, row);
            self.squares.push(subspace::dot(vector, vector));
        }
    }
}

/// Writes a vector to the beginning of a row.
#[inline(always)]
fn widen(vector: &[f32], row: &mut [f64]) {
    for (out, &value) in row.iter_mut().zip(vector) {
        *out = f64::from(value);
    }
}
