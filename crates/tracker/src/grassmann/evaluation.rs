//! The distances of the candidates of a frame to the bag.

use pulp::{Arch, Simd};

use crate::grassmann::batch::Batch;
use crate::grassmann::distance::Entry;
use crate::grassmann::inner_products::InnerProducts;
use crate::grassmann::subspace::{self, AffineSubspace};
use crate::grassmann::{LANES, distance};
use crate::params::table::Params;

/// The evaluation of N candidates against a bag, exactly as [`Tracker::step`](crate::Tracker::step)
/// does it.
///
/// The order of calls is: [`set_bag`](Self::set_bag) whenever the bag changed, then [`distances`](Self::distances). The
/// buffers are kept, so one value serves all frames.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    params: Params,
    entries: Vec<Entry>,
    products: InnerProducts,
    /// For each candidate, its distance to each entry.
    distances: Vec<f64>,
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
        self.products.prepare(params);
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

    /// dist(Aᵢ, B\[k\]) (equation 4), in \[0, 1\]: for each candidate its distance to each entry of the bag. `candidates`
    /// are at most N feature vectors of length D with finite values, one after the other, and `history` the 1 to P
    /// previous patches, each of length D.
    ///
    /// # Panics
    /// If no bag was set, there are more than P previous patches or none, or one of them is not of length D.
    pub fn distances<'a>(
        &mut self,
        candidates: &[f32],
        history: impl ExactSizeIterator<Item = &'a [f32]>,
    ) -> &[f64] {
        let columns = history.len() + 1;
        self.products.set_history(history);
        let count = candidates.len() / self.params.feature_len();
        self.distances.clear();
        self.distances.resize(count * self.entries.len(), 0.0);
        compare(self, candidates, columns);
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
        let (entries, params) = (self.entries.len(), &self.params);
        let rows = self.distances.chunks_mut(LANES * entries);
        let batches = candidates.chunks(LANES * params.feature_len());
        for (candidates, rows) in batches.zip(rows) {
            let products = &mut self.products;
            products.multiply(simd, candidates);
            let batch = Batch::<M, N>::of(&products.gram(), columns, params.basis_dim as usize);
            for (k, &entry) in self.entries.iter().enumerate() {
                let distances = distance::between(&batch, (k, entry), products, columns, params);
                let values = rows[k..].iter_mut().step_by(entries);
                for (value, distance) in values.zip(distances.0) {
                    *value = distance;
                }
            }
        }
    }
}

/// [`Evaluation::compare_as`] with matrices of the paper's size, or of the largest; compiled for this machine's
/// instructions.
#[pulp::with_simd(compare = Arch::new())]
#[inline(always)]
fn compare_simd<S: Simd>(simd: S, evaluation: &mut Evaluation, candidates: &[f32], columns: usize) {
    if evaluation.params.history <= 5 && evaluation.params.basis_dim <= 3 {
        evaluation.compare_as::<S, 6, 3>(simd, candidates, columns);
    } else {
        evaluation.compare_as::<S, 11, 6>(simd, candidates, columns);
    }
}
