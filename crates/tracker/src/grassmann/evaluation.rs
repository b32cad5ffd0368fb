//! The distances of the candidates of a frame to the bag (section III-D).

use std::f64::consts::PI;

use nalgebra::{DMatrixView, DVectorView, SMatrix, SVector};
use pulp::{Arch, Simd};

use crate::grassmann::principal_angles;
use crate::grassmann::subspace::{self, AffineSubspace, MAX_VECTORS};
use crate::linalg::{gemm, jacobi};
use crate::params::table::Params;

/// The greatest n, the number of basis vectors.
const MAX_DIM: usize = 6;
/// Candidates that are compared together: more of the longest vectors would take many megabytes.
const BATCH: usize = 128;

/// The evaluation of N candidates against a bag, as [`Tracker::step`](crate::Tracker::step) does it with the preset
/// `paper`.
///
/// The order of calls is: [`set_bag`](Self::set_bag) whenever the bag changed, then [`distances`](Self::distances). The
/// buffers are kept, so one value serves all frames.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    params: Params,
    entries: Vec<Entry>,
    /// μ₁, F₁, …, μ_K, F_K, of D values each, and then H.
    bag: Vec<f64>,
    /// H, and then a batch of candidates.
    patches: Vec<f64>,
    /// For each of `patches`, its inner products with all of `bag`.
    products: Vec<f64>,
    /// For each candidate, its distance to each entry.
    distances: Vec<f64>,
}

/// An entry {μₖ, Fₖ} of the bag.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// ‖μₖ‖².
    mean_square: f64,
    /// The number of columns of Fₖ.
    dim: usize,
}

/// A candidate's subspace {μ, U} (equation 1) of V = [v, H] (equation 2). Matrices have M rows for the columns of V, N
/// columns for those of U, and are zero beyond.
struct Candidate<const M: usize, const N: usize> {
    /// P + 1, the number of columns of V.
    columns: usize,
    /// ‖μ‖².
    mean_square: f64,
    /// W S⁻¹, so that U = V W S⁻¹.
    coefficients: SMatrix<f64, M, N>,
    /// The number of columns of U: n, or fewer where V has fewer directions.
    dim: usize,
}

impl<const M: usize, const N: usize> Candidate<M, N> {
    /// The candidate's subspace, from VᵀV.
    #[inline(always)]
    fn of(gram: SMatrix<f64, M, M>, columns: usize, basis_dim: usize) -> Self {
        // μ = V 1 / (P + 1).
        let mean_square = gram.sum() / (columns * columns) as f64;
        // VᵀV = W S² Wᵀ.
        let (squares, w) = jacobi::eigenpairs(gram);
        let dim = subspace::dominant(squares.iter().copied(), basis_dim);
        let mut coefficients = SMatrix::<f64, M, N>::zeros();
        for j in 0..dim {
            coefficients.set_column(j, &(w.column(j) / squares[j].sqrt()));
        }
        Self {
            columns,
            mean_square,
            coefficients,
            dim,
        }
    }

    /// dist(A, B\[k\]) (equation 4), from Vᵀμₖ and VᵀFₖ.
    #[inline(always)]
    fn distance(
        &self,
        entry: Entry,
        of_mean: SVector<f64, M>,
        of_basis: SMatrix<f64, M, N>,
        params: &Params,
    ) -> f64 {
        // ‖μ - μₖ‖² (equation 5); rounding can put it below 0.
        let mean_product = of_mean.sum() / self.columns as f64;
        let origins = (self.mean_square - 2.0 * mean_product + entry.mean_square).max(0.0);
        let gamma = 1.0 / params.feature_len() as f64;
        // UᵀFₖ = (W S⁻¹)ᵀ VᵀFₖ.
        let n = self.dim.min(entry.dim);
        let angles = principal_angles::squared_norm(&self.coefficients.tr_mul(&of_basis), n);
        let beta = 4.0 / (n.max(1) as f64 * PI * PI);
        params.alpha * gamma * origins + (1.0 - params.alpha) * beta * angles
    }
}

impl Evaluation {
    /// The evaluation for `params`, which must be valid.
    pub fn new(params: &Params) -> Self {
        let mut evaluation = Self::default();
        evaluation.prepare(params);
        evaluation
    }

    /// Becomes the evaluation for other `params`. The bag must be set again.
    pub(crate) fn prepare(&mut self, params: &Params) {
        self.params = params.clone();
        self.entries.clear();
    }

    /// Takes the entries of the bag: at least one, each with means of length D and at most n basis vectors.
    pub fn set_bag<'a>(&mut self, bag: impl ExactSizeIterator<Item = &'a AffineSubspace>) {
        self.entries.clear();
        self.bag.clear();
        for subspace in bag {
            let first = self.bag.len();
            widen(subspace.mean(), &mut self.bag);
            self.entries.push(Entry {
                mean_square: square(&self.bag[first..]),
                dim: subspace.dim(),
            });
            widen(&subspace.basis, &mut self.bag);
        }
    }

    /// dist(Aᵢ, B\[k\]) (equation 4), in \[0, 1\]: for each candidate its distance to each entry of the bag.
    /// `candidates` are feature vectors of length D with finite values, one after the other, and `history` the 1 to P
    /// previous patches, each of length D.
    ///
    /// # Panics
    /// If no bag was set, there are more than P previous patches or none, or one of them is not of length D.
    pub fn distances<'a>(
        &mut self,
        candidates: &[f32],
        history: impl ExactSizeIterator<Item = &'a [f32]>,
    ) -> &[f64] {
        assert!(!self.entries.is_empty(), "a bag was set");
        let previous = history.len();
        let allowed = 1..=self.params.history as usize;
        assert!(allowed.contains(&previous), "1 to P previous patches");
        let len = self.params.feature_len();
        self.patches.clear();
        for patch in history {
            assert_eq!(patch.len(), len, "a patch of D values");
            widen(patch, &mut self.patches);
        }
        let vectors: usize = self.entries.iter().map(|entry| 1 + entry.dim).sum();
        self.bag.truncate(vectors * len);
        self.bag.extend_from_slice(&self.patches);
        let columns = vectors + previous;
        self.distances.clear();
        for batch in candidates.chunks(BATCH * len) {
            self.patches.truncate(previous * len);
            widen(batch, &mut self.patches);
            let (patches, products) = (&self.patches, &mut self.products);
            products.resize(patches.len() / len * columns, 0.0);
            gemm::inner_products(patches, &self.bag, len, columns, products);
            compare(self, vectors, previous);
        }
        &self.distances
    }
}

/// Appends the distances of a batch, with matrices of the paper's sizes where these suffice, else of the largest sizes.
#[pulp::with_simd(compare = Arch::new())]
#[inline(always)]
fn compare_simd<S: Simd>(_: S, evaluation: &mut Evaluation, vectors: usize, previous: usize) {
    match previous <= 5 && evaluation.params.basis_dim <= 3 {
        true => compare_as::<6, 3>(evaluation, vectors, previous),
        false => compare_as::<MAX_VECTORS, MAX_DIM>(evaluation, vectors, previous),
    }
}

/// Appends the distances of a batch, from its inner products with the `vectors` means and basis vectors of the bag and
/// with the `previous` patches.
#[inline(always)]
fn compare_as<const M: usize, const N: usize>(
    evaluation: &mut Evaluation,
    vectors: usize,
    previous: usize,
) {
    let (params, len) = (&evaluation.params, evaluation.params.feature_len());
    let (rows, columns) = (vectors + previous, evaluation.patches.len() / len);
    let products = DMatrixView::from_slice(&evaluation.products, rows, columns);
    let patches = evaluation.patches.chunks_exact(len).enumerate();
    for (i, v) in patches.skip(previous) {
        // The products of V = [v, H] with vector `x` of `bag`; zero beyond the columns of V.
        let with = |x: usize| {
            let mut column = SVector::<f64, M>::zeros();
            column[0] = products[(x, i)];
            (0..previous).for_each(|j| column[1 + j] = products[(x, j)]);
            column
        };
        let mut gram = SMatrix::<f64, M, M>::zeros();
        gram[(0, 0)] = square(v);
        for j in 1..=previous {
            let column = with(vectors + j - 1);
            gram.set_column(j, &column);
            gram[(j, 0)] = column[0];
        }
        let candidate = Candidate::<M, N>::of(gram, 1 + previous, params.basis_dim as usize);
        let mut mean = 0;
        for &entry in &evaluation.entries {
            let mut of_basis = SMatrix::<f64, M, N>::zeros();
            for j in 0..entry.dim {
                of_basis.set_column(j, &with(mean + 1 + j));
            }
            let distance = candidate.distance(entry, with(mean), of_basis, params);
            evaluation.distances.push(distance);
            mean += 1 + entry.dim;
        }
    }
}

/// ‖v‖².
fn square(v: &[f64]) -> f64 {
    DVectorView::from_slice(v, v.len()).norm_squared()
}

/// Appends `values` in double precision.
fn widen(values: &[f32], out: &mut Vec<f64>) {
    out.extend(values.iter().map(|&value| f64::from(value)));
}
