//! The one large computation of a frame: all inner products, as a single matrix product.
//!
//! Nothing of size D x (P + 1) is decomposed for a candidate. All candidates of a frame share the P previous
//! patches H. With an orthonormal basis Q of their span, found once a frame from the small matrix HᵀH, the inner
//! products of a candidate with Q and with the vectors in the bag say everything about its affine subspace and its
//! distances.
//!
//! The hazard is cancellation: candidate and history are nearly the same vector, and what matters is the
//! difference. So the product is that of differences, d = v - h with h the newest patch of the history, and single
//! precision is enough for them: what belongs to h itself is known in double precision, once for all candidates. What
//! remains is a candidate whose d lies in the span of the history but for a small rest: that rest is computed in
//! double precision, by subtraction of vectors (see [`Products::resolve`]).

use pulp::Simd;

use crate::tracker::abreast::{ABREAST, Doubles, Singles};
use crate::tracker::appearance::subspace::{self, AffineSubspace};
use crate::tracker::history::{self, SharedHistory};
use crate::tracker::linalg::gemm;
use crate::tracker::params::table::Params;

/// Between two vectors, in values: rows of 1024 values would all begin at the same place of the first cache.
const GAP: usize = 16;

/// Most candidates in a tile of the product.
const MAX_ROWS: usize = 6;

/// A rest shorter than this share of d (both squared) has lost digits that count.
const SMALL_REST: f64 = 0.001;

/// A rest shorter than this share of the candidate (both squared) is rounding.
const NO_REST: f64 = 1e-13;

/// The inner products of what is particular to each candidate with (Q, the sum of V, the bag), and what they are made up
/// with.
#[derive(Debug, Clone, Default)]
pub(crate) struct Products {
    len: usize,
    /// From one vector of `right` to the next.
    stride: usize,
    candidates: usize,
    /// Candidates by [`ABREAST`], rounded up.
    groups: usize,
    slots: usize,
    basis_dim: usize,
    entries: usize,
    /// The candidates v, one after the other.
    candidate_vectors: Vec<f32>,
    /// The differences d of one tile.
    tile: Vec<f32>,
    /// Q (P slots, zero where there is no direction), h + the sum of H, the means of the bag's entries, their first basis
    /// vectors, their second and so on: one vector a column.
    right: Vec<f32>,
    /// For each vector of `right` its products with d of all candidates.
    out: Vec<Singles>,
    /// For each slot Qᵀv of all candidates.
    coordinates: Vec<Doubles>,
    /// The length ρ of what of each candidate is not in the span of the history, or 0.
    rests: Vec<Doubles>,
    /// ‖d‖² of each candidate.
    squares: Vec<Doubles>,
    /// For each slot its products with the bases of the bag.
    of_directions: Vec<f32>,
    history: SharedHistory,
    /// The products of h + the sum of H with the means of the bag.
    shared_means: Vec<f64>,
    /// A rest, in double precision.
    rest: Vec<f64>,
}

impl Products {
    /// Makes room for these parameters.
    pub fn prepare(&mut self, params: &Params) {
        self.len = params.feature_len();
        self.stride = self.len.next_multiple_of(GAP) + GAP;
        self.candidates = params.particles as usize;
        self.groups = self.candidates.div_ceil(ABREAST);
        self.slots = params.history as usize;
        self.basis_dim = params.basis_dim as usize;
        self.entries = 0;
        self.candidate_vectors
            .resize(self.candidates * self.len, 0.0);
        let tile = MAX_ROWS * self.stride;
        self.tile.clear();
        self.tile.resize(tile, 0.0);
        let scratch = [0.0; ABREAST];
        self.coordinates.clear();
        self.coordinates.resize(self.groups * self.slots, scratch);
        self.rests.clear();
        self.rests.resize(self.groups, scratch);
        self.squares.clear();
        self.squares.resize(self.groups, scratch);
        self.history.prepare(self.slots, self.len);
        self.rest.resize(self.len, 0.0);
    }

    /// The feature vector of candidate `index`, to be filled in.
    pub fn candidate_mut(&mut self, index: usize) -> &mut [f32] {
        &mut self.candidate_vectors[index * self.len..][..self.len]
    }

    /// The feature vectors of all candidates, one after the other, to be filled in.
    pub fn candidates_mut(&mut self) -> &mut [f32] {
        &mut self.candidate_vectors
    }

    fn columns(&self) -> usize {
        self.slots + 1 + self.entries * (self.basis_dim + 1)
    }

    /// Takes the vectors of the bag's entries.
    pub fn set_bag<'a>(&mut self, entries: impl ExactSizeIterator<Item = &'a AffineSubspace>) {
        let (len, stride, count) = (self.len, self.stride, entries.len());
        if count != self.entries {
            self.entries = count;
            let values = self.columns() * stride;
            self.right.clear();
            self.right.resize(values, 0.0);
            self.out.clear();
            self.out
                .resize(self.columns() * self.groups, [0.0; ABREAST]);
            self.of_directions
                .resize(self.slots * count * self.basis_dim, 0.0);
            self.shared_means.resize(count, 0.0);
        }
        let right = &mut self.right[(self.slots + 1) * stride..];
        for (k, entry) in entries.enumerate() {
            let vectors = entry.mean.chunks_exact(len).chain(entry.basis());
            for (column, vector) in vectors.enumerate() {
                right[(column * count + k) * stride..][..len].copy_from_slice(vector);
            }
            for column in entry.dim() + 1..=self.basis_dim {
                right[(column * count + k) * stride..][..len].fill(0.0);
            }
        }
    }

    /// Computes all products of the candidates with `history`, the previous patches, and the bag.
    #[inline(always)]
    pub fn compute<S: Simd>(&mut self, simd: S, history: &[&[f32]]) {
        let right = &mut self.right;
        let (shared, bag) = right.split_at_mut((self.slots + 1) * self.stride);
        self.history.take(history, shared, self.stride);
        let means = bag.chunks_exact(self.stride);
        for (product, mean) in self.shared_means.iter_mut().zip(means) {
            *product = history::dot(self.history.sum(), mean);
        }
        self.multiply_directions(simd);
        if S::REGISTER_COUNT >= 32 {
            self.multiply::<S, MAX_ROWS, 4>(simd, history[0]);
        } else {
            self.multiply::<S, 4, 3>(simd, history[0]);
        }
    }

    /// Qᵀ times the bases of the bag.
    #[inline(always)]
    fn multiply_directions<S: Simd>(&mut self, simd: S) {
        let bases = (self.slots + 1 + self.entries) * self.stride;
        let right = &self.right;
        let directions = &right[..self.slots * self.stride];
        let columns = self.entries * self.basis_dim;
        let out = &mut self.of_directions;
        gemm::multiply(simd, directions, &right[bases..], self.stride, columns, out);
    }

    #[inline(always)]
    fn multiply<S: Simd, const A: usize, const B: usize>(&mut self, simd: S, newest: &[f32]) {
        let (len, stride, columns) = (self.len, self.stride, self.columns());
        let lanes = self.groups * ABREAST;
        for first in (0..self.candidates).step_by(A) {
            let count = A.min(self.candidates - first);
            let tile = &mut self.tile;
            let squares = self.squares.as_flattened_mut();
            for (row, index) in tile.chunks_exact_mut(stride).zip(first..first + count) {
                let vector = &self.candidate_vectors[index * len..][..len];
                squares[index] = subtract(vector, newest, &mut row[..len]);
            }
            let tile = &self.tile;
            let mut rows_a = [&tile[..0]; A];
            for (p, row) in rows_a.iter_mut().enumerate() {
                // A tile at the end has the last vector more than once.
                *row = &tile[p.min(count - 1) * stride..][..stride];
            }
            let right = &self.right;
            let out = self.out.as_flattened_mut();
            for j in (0..columns).step_by(B) {
                let mut rows_b = [&right[..0]; B];
                for (q, row) in rows_b.iter_mut().enumerate() {
                    *row = &right[(j + q).min(columns - 1) * stride..][..stride];
                }
                let products = gemm::tile(simd, rows_a, rows_b);
                for q in 0..B.min(columns - j) {
                    let out = &mut out[(j + q) * lanes + first..][..count];
                    for (out, products) in out.iter_mut().zip(&products) {
                        *out = products[q];
                    }
                }
            }
            for p in 0..count {
                self.find_rest(first + p, p);
            }
        }
    }

    /// Qᵀv and ρ of candidate `index`, whose d is row `row` of the tile.
    #[inline(always)]
    fn find_rest(&mut self, index: usize, row: usize) {
        let lanes = self.groups * ABREAST;
        let out = self.out.as_flattened();
        let coordinates = self.coordinates.as_flattened_mut();
        let square = self.squares.as_flattened()[index];
        let (mut norm, mut inside) = (0.0, 0.0);
        for (slot, reference) in self.history.newest().iter().enumerate() {
            let along = f64::from(out[slot * lanes + index]);
            let coordinate = reference + along;
            coordinates[slot * lanes + index] = coordinate;
            inside += along * along;
            norm += coordinate * coordinate;
        }
        let mut rest = square - inside;
        if rest < square * SMALL_REST && square > norm * NO_REST {
            rest = self.resolve(index, row);
        }
        let counts = rest > (norm + rest) * NO_REST;
        self.rests.as_flattened_mut()[index] = if counts { rest.sqrt() } else { 0.0 };
    }

    /// Finds the rest of candidate `index` as a vector, and puts its products in the place of those of d; gives its
    /// squared length.
    #[inline(always)]
    fn resolve(&mut self, index: usize, row: usize) -> f64 {
        let (stride, lanes) = (self.stride, self.groups * ABREAST);
        let tile = &self.tile[row * stride..];
        for (rest, value) in self.rest.iter_mut().zip(tile) {
            *rest = f64::from(*value);
        }
        let out = self.out.as_flattened_mut();
        let coordinates = self.coordinates.as_flattened_mut();
        for (slot, reference) in self.history.newest().iter().enumerate() {
            coordinates[slot * lanes + index] = *reference;
            out[slot * lanes + index] = 0.0;
        }
        let mut vectors = self.right.chunks_exact(stride);
        // Twice, since Q is rounded.
        for _ in 0..2 {
            let directions = vectors.clone().take(self.slots);
            for (slot, direction) in directions.enumerate() {
                let along = history::dot(&self.rest, direction);
                coordinates[slot * lanes + index] += along;
                subspace::accumulate(&mut self.rest, direction, -along);
            }
        }
        let bases = self.slots + 1 + self.entries;
        vectors.by_ref().take(bases).for_each(drop);
        for (column, basis) in (bases..).zip(vectors) {
            out[column * lanes + index] = history::dot(&self.rest, basis) as f32;
        }
        self.rest.iter().map(|value| value * value).sum()
    }

    /// The products of what the candidates of a group have for themselves.
    pub fn group(&self, index: usize) -> Group<'_> {
        Group {
            products: self,
            index,
        }
    }

    /// The number of groups of [`ABREAST`] candidates.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// The products of direction `slot` of Q with the bases of the bag: with the first basis vectors of all entries, with
    /// the second, and so on.
    #[inline(always)]
    pub fn of_direction(&self, slot: usize) -> &[f32] {
        let columns = self.entries * self.basis_dim;
        &self.of_directions[slot * columns..][..columns]
    }

    /// What all candidates share.
    pub fn history(&self) -> &SharedHistory {
        &self.history
    }

    /// The products of h + the sum of H with the means of the bag's entries.
    pub fn shared_means(&self) -> &[f64] {
        &self.shared_means
    }
}

/// The products of one group of candidates. What is called the rest is d but for what is in the span of Q; the products
/// of d serve for it together with those of Qᵀd, unless it was found by itself and these are zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Group<'a> {
    products: &'a Products,
    index: usize,
}

impl<'a> Group<'a> {
    #[inline(always)]
    fn column(self, column: usize) -> &'a Singles {
        &self.products.out[column * self.products.groups + self.index]
    }

    /// Qᵀv along direction `slot`.
    #[inline(always)]
    pub fn coordinate(self, slot: usize) -> &'a Doubles {
        &self.products.coordinates[slot * self.products.groups + self.index]
    }

    /// What is to be taken off the products with the bag of d along direction `slot`, in order to have those of the rest.
    #[inline(always)]
    pub fn along(self, slot: usize) -> &'a Singles {
        self.column(slot)
    }

    /// ρ, or 0 if v is in the span of the history.
    #[inline(always)]
    pub fn rest(self) -> &'a Doubles {
        &self.products.rests[self.index]
    }

    /// ‖d‖².
    #[inline(always)]
    pub fn square(self) -> &'a Doubles {
        &self.products.squares[self.index]
    }

    /// d with h + the sum of H.
    #[inline(always)]
    pub fn with_shared(self) -> &'a Singles {
        self.column(self.products.slots)
    }

    /// d with the mean of entry `k`.
    #[inline(always)]
    pub fn with_mean(self, k: usize) -> &'a Singles {
        self.column(self.products.slots + 1 + k)
    }

    /// With basis vector `column` of entry `k`; zero for one that it does not have.
    #[inline(always)]
    pub fn with_basis(self, column: usize, k: usize) -> &'a Singles {
        let first = self.products.slots + 1 + self.products.entries;
        self.column(first + column * self.products.entries + k)
    }
}

/// `difference = a - b`; gives its squared length.
#[inline(always)]
fn subtract(a: &[f32], b: &[f32], difference: &mut [f32]) -> f64 {
    const PARTS: usize = 32;
    let mut parts = [0.0_f32; PARTS];
    let (chunks, rest) = difference.as_chunks_mut::<PARTS>();
    let (a_chunks, a_rest) = a.as_chunks::<PARTS>();
    let (b_chunks, b_rest) = b.as_chunks::<PARTS>();
    for (chunk, (a, b)) in chunks.iter_mut().zip(a_chunks.iter().zip(b_chunks)) {
        for part in 0..PARTS {
            let value = a[part] - b[part];
            chunk[part] = value;
            parts[part] += value * value;
        }
    }
    let mut sum: f64 = parts.iter().map(|&part| f64::from(part)).sum();
    for (value, (a, b)) in rest.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *value = a - b;
        sum += f64::from(*value * *value);
    }
    sum
}
