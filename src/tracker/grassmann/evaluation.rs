//! The candidates of a frame against the bag: distances, likelihoods, weights, the best one.

use crate::tracker::appearance::subspace::{self, AffineSubspace};
use crate::tracker::grassmann::candidate::Candidate;
use crate::tracker::grassmann::distance::{Distance, Entry};
use crate::tracker::grassmann::inner_products::InnerProducts;
use crate::tracker::params::table::Params;
use crate::tracker::weights::likelihood::{self, Likelihoods};

/// The evaluation of N candidates against a bag, exactly as [`Tracker::step`](crate::tracker::tracker::Tracker::step)
/// does it.
///
/// The order of calls is: [`set_bag`](Self::set_bag) whenever the bag changed,
/// [`candidate_mut`](Self::candidate_mut) for each of the N candidates, [`compute`](Self::compute), then the results.
/// The buffers are kept, so one value serves all frames.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    sigma: f64,
    /// D.
    len: usize,
    /// P.
    patches: usize,
    /// n.
    basis_dim: usize,
    /// The feature vectors of the N candidates, one after the other.
    candidates: Vec<f32>,
    entries: Vec<Entry>,
    products: InnerProducts,
    distance: Distance,
    /// The number of basis vectors of each candidate.
    dims: Vec<usize>,
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
            candidates: vec![0.0; params.particles as usize * params.feature_len()],
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

    /// The feature vector v of candidate `index`, of length D, to be filled in with finite values.
    ///
    /// # Panics
    /// If `index` is N or more.
    pub fn candidate_mut(&mut self, index: usize) -> &mut [f32] {
        let mut candidates = self.candidates.chunks_exact_mut(self.len);
        candidates.nth(index).expect("a candidate below N")
    }

    /// The feature vectors of all N candidates, one after the other, to be filled in with finite values.
    pub fn candidates_mut(&mut self) -> &mut [f32] {
        &mut self.candidates
    }

    /// Compares every candidate, together with `history` (the 1 to P previous patches, each of length D), with every
    /// entry of the bag.
    ///
    /// # Panics
    /// If no bag was set, there are more than P previous patches or none, or one of them is not of length D.
    pub fn compute(&mut self, history: &[&[f32]]) {
        let candidates = self.candidates.len() / self.len;
        self.compute_distances(candidates, history);
        self.weights.clear();
        self.weights.resize(candidates, 0.0);
        self.likelihoods
            .weigh(&self.distances, self.sigma, (0, 1.0), &mut self.weights);
    }

    /// The first half of [`compute`](Self::compute), for the first `count` candidates: the distances alone, which it
    /// returns.
    pub(crate) fn compute_distances(&mut self, count: usize, history: &[&[f32]]) -> &[f64] {
        let candidates = &self.candidates[..count * self.len];
        self.products.compute(candidates, history);
        self.dims.clear();
        self.distances.clear();
        let columns = history.len() + 1;
        // Matrices of the paper's size, or of the largest.
        if self.patches <= 5 && self.basis_dim <= 3 {
            self.compare::<6, 3>(count, columns);
        } else {
            self.compare::<11, 6>(count, columns);
        }
        &self.distances
    }

    /// The distances of the first `count` candidates, each with V of so many `columns`: M at most, and N basis vectors.
    fn compare<const M: usize, const N: usize>(&mut self, count: usize, columns: usize) {
        for i in 0..count {
            let gram = self.products.gram::<M>(i);
            let candidate = Candidate::<M, N>::of(gram, columns, self.basis_dim);
            self.dims.push(candidate.dim);
            for (k, &entry) in self.entries.iter().enumerate() {
                let (candidate, entry) = ((i, &candidate), (k, entry));
                let products = &self.products;
                self.distances
                    .push(self.distance.between(candidate, entry, products, columns));
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

    /// The number of basis vectors in the subspace of candidate `index`.
    pub fn basis_dim(&self, index: usize) -> usize {
        self.dims[index]
    }

    /// The most likely candidate (equation 12).
    pub fn best(&self) -> usize {
        likelihood::arg_max(&self.weights)
    }
}
