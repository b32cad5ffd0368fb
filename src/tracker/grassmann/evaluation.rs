//! The candidates of a frame against the bag: distances, likelihoods, weights, the best one.

use pulp::{Arch, Simd};

use crate::tracker::appearance::subspace::{self, AffineSubspace};
use crate::tracker::grassmann::LANES;
use crate::tracker::grassmann::batch::Batch;
use crate::tracker::grassmann::distance::{Distance, Entry};
use crate::tracker::grassmann::inner_products::InnerProducts;
use crate::tracker::params::table::Params;
use crate::tracker::weights::likelihood::{self, Likelihoods};

/// The evaluation of N candidates against a bag, exactly as [`Tracker::step`](crate::tracker::tracker::Tracker::step)
/// does it.
///
/// The order of calls is: [`set_bag`](Self::set_bag) whenever the bag changed, [`compute`](Self::compute), then the
/// results. The buffers are kept, so one value serves all frames.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    sigma: f64,
    /// D.
    len: usize,
    /// P.
    patches: usize,
    /// n.
    basis_dim: usize,
    entries: Vec<Entry>,
    products: InnerProducts,
    distance: Distance,
    /// For each candidate, its distance to each entry.
    distances: Vec<f64>,
    likelihoods: Likelihoods,
    weights: Vec<f64>,
}

impl Evaluation {
    /// The evaluation for `params`, which must be valid.
    pub fn new(params: &Params) -> Self {
        let mut evaluation = Self {
            sigma: params.sigma,
            len: params.feature_len(),
            patches: params.history as usize,
            basis_dim: params.basis_dim as usize,
            distance: Distance::of(params),
            ..Self::default()
        };
        evaluation.products.prepare(params);
        evaluation
    }

    /// Takes the entries of the bag: at least one, each with means of length D and at most n basis vectors.
    pub fn set_bag<'a>(&mut self, bag: impl ExactSizeIterator<Item = &'a AffineSubspace> + Clone) {
        self.entries.clear();
        self.entries.extend(bag.clone().map(|entry| Entry {
            mean_square: subspace::dot(entry.mean(), entry.mean()),
            dim: entry.dim(),
        }));
        self.products.set_bag(bag);
    }

    /// Compares `candidates` (at most N feature vectors of length D with finite values, one after the other), together
    /// with `history` (the 1 to P previous patches, each of length D), with every entry of the bag.
    ///
    /// # Panics
    /// If no bag was set, there are more than P previous patches or none, or one of them is not of length D.
    pub fn compute(&mut self, candidates: &[f32], history: &[&[f32]]) {
        self.compute_distances(candidates, history);
        self.weights.clear();
        self.weights.resize(candidates.len() / self.len, 0.0);
        self.likelihoods
            .weigh(&self.distances, self.sigma, (0, 1.0), &mut self.weights);
    }

    /// The first half of [`compute`](Self::compute): the distances alone, which it returns.
    pub(crate) fn compute_distances(&mut self, candidates: &[f32], history: &[&[f32]]) -> &[f64] {
        self.products.set_history(history);
        let count = candidates.len() / self.len;
        self.distances.clear();
        self.distances.resize(count * self.entries.len(), 0.0);
        compare(self, candidates, history.len() + 1);
        &self.distances
    }

    /// Compares `candidates`, each with V of so many `columns`: M at most, and N basis vectors.
    #[inline(always)]
    fn compare_as<S: Simd, const M: usize, const N: usize>(
        &mut self,
        simd: S,
        candidates: &[f32],
        columns: usize,
    ) {
        let entries = self.entries.len();
        let rows = self.distances.chunks_mut(LANES * entries);
        for (candidates, rows) in candidates.chunks(LANES * self.len).zip(rows) {
            self.products.multiply(simd, candidates);
            let batch = Batch::<M, N>::of(&self.products.gram(), columns, self.basis_dim);
            for (k, &entry) in self.entries.iter().enumerate() {
                let distances = self
                    .distance
                    .between(&batch, (k, entry), &self.products, columns);
                let values = rows[k..].iter_mut().step_by(entries);
                for (value, distance) in values.zip(distances.0) {
                    *value = distance;
                }
            }
        }
    }

    fn row<'a>(&self, values: &'a [f64], index: usize) -> &'a [f64] {
        &values[index * self.entries.len()..][..self.entries.len()]
    }

    /// dist(Aᵢ, B\[k\]) (equation 4), in [0, 1], of candidate `index` to each entry of the bag.
    pub fn distances(&self, index: usize) -> &[f64] {
        self.row(&self.distances, index)
    }

    /// p̂(Aᵢ | B\[k\]) (equation 10) of candidate `index` for each entry of the bag; over the candidates they sum to 1.
    pub fn likelihoods(&self, index: usize) -> &[f64] {
        self.row(self.likelihoods.normalized(), index)
    }

    /// The weights of the N particles: equation 9, scaled to sum to 1.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The most likely candidate (equation 12).
    pub fn best(&self) -> usize {
        likelihood::arg_max(&self.weights)
    }
}

/// [`Evaluation::compare_as`] with matrices of the paper's size, or of the largest; compiled for this machine's
/// instructions.
#[pulp::with_simd(compare = Arch::new())]
#[inline(always)]
fn compare_simd<S: Simd>(simd: S, evaluation: &mut Evaluation, candidates: &[f32], columns: usize) {
    if evaluation.patches <= 5 && evaluation.basis_dim <= 3 {
        evaluation.compare_as::<S, 6, 3>(simd, candidates, columns);
    } else {
        evaluation.compare_as::<S, 11, 6>(simd, candidates, columns);
    }
}
