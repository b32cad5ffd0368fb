//! (D) The candidates of a frame against the bag: distances, likelihoods, the best one.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::appearance::subspace::{self, AffineSubspace};
use crate::tracker::candidate::CandidateBases;
use crate::tracker::distance::Distances;
use crate::tracker::params::table::Params;
use crate::tracker::products::Products;
use crate::tracker::weights::likelihood;

/// The evaluation of N candidates against a bag, exactly as [`Tracker::step`](crate::tracker::tracker::Tracker::step) does it.
///
/// The order of calls is: [`set_bag`](Self::set_bag) whenever the bag changed,
/// [`candidate_mut`](Self::candidate_mut) for each of the N candidates, [`compute`](Self::compute), then the results.
/// The buffers are kept, so one value serves all frames.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    sigma: f64,
    candidates: usize,
    /// ‖μₖ‖² and the number of basis vectors of each entry.
    entries: Vec<(f64, usize)>,
    products: Products,
    bases: CandidateBases,
    distances: Distances,
    likelihoods: Vec<f64>,
    weights: Vec<f64>,
}

// The parts of `Evaluation::compute`, each to be compiled for the instructions that this machine has. Everything in them is
// inlined, since a function of its own would be compiled for the least of machines; in one part they would take the compiler
// several times as long.

/// The inner products.
struct ComputeProducts<'a> {
    products: &'a mut Products,
    history: &'a [&'a [f32]],
}

/// The bases of the candidates.
struct ComputeBases<'a> {
    bases: &'a mut CandidateBases,
    products: &'a Products,
}

/// The distances.
struct ComputeDistances<'a> {
    distances: &'a mut Distances,
    products: &'a Products,
    bases: &'a CandidateBases,
    candidates: usize,
    entries: &'a [(f64, usize)],
}

impl WithSimd for ComputeProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.products.compute(simd, self.history);
    }
}

impl WithSimd for ComputeBases<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.bases.compute(self.products);
    }
}

impl WithSimd for ComputeDistances<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.distances
            .compute(self.products, self.bases, self.candidates, self.entries);
    }
}

impl Evaluation {
    /// The evaluation for `params`, which must be valid.
    pub fn new(params: &Params) -> Self {
        let mut evaluation = Self::default();
        evaluation.prepare(params);
        evaluation
    }

    /// Becomes the evaluation for `params`, in the room that it has. The bag must be set again.
    pub(crate) fn prepare(&mut self, params: &Params) {
        self.sigma = params.sigma;
        self.candidates = params.particles as usize;
        self.entries.clear();
        self.products.prepare(params);
        self.bases.prepare(params);
        self.distances.prepare(params);
    }

    /// Takes the entries of the bag: at least one, each with means of length D and at most n basis vectors.
    pub fn set_bag<'a>(&mut self, bag: impl ExactSizeIterator<Item = &'a AffineSubspace> + Clone) {
        self.entries.clear();
        self.entries.extend(
            bag.clone()
                .map(|entry| (subspace::dot(&entry.mean, &entry.mean), entry.dim())),
        );
        self.products.set_bag(bag);
    }

    /// The feature vector v of candidate `index`, of length D, to be filled in.
    ///
    /// # Panics
    /// If `index` is N or more.
    pub fn candidate_mut(&mut self, index: usize) -> &mut [f32] {
        assert!(index < self.candidates, "a candidate below N");
        self.products.candidate_mut(index)
    }

    /// The feature vectors of all N candidates, one after the other, to be filled in.
    pub fn candidates_mut(&mut self) -> &mut [f32] {
        self.products.candidates_mut()
    }

    /// Compares every candidate, together with `history` (the 1 to P previous patches, each of length D), with every
    /// entry of the bag.
    ///
    /// # Panics
    /// If no bag was set, there are more than P previous patches, or one of them is longer than D.
    pub fn compute(&mut self, history: &[&[f32]]) {
        self.compute_distances(self.candidates, history);
        let entries = self.entries.len();
        likelihood::normalized(
            self.distances.values(),
            entries,
            self.sigma,
            &mut self.likelihoods,
        );
        likelihood::sum_rule(&self.likelihoods, entries, (0, 1.0), &mut self.weights);
    }

    /// The first half of [`compute`](Self::compute), for the first `count` candidates: the distances alone, which it returns.
    pub(crate) fn compute_distances(&mut self, count: usize, history: &[&[f32]]) -> &[f64] {
        // Candidates are diagonalised side by side: what another frame left there would change the last bits.
        for index in count..self.candidates {
            self.candidate_mut(index).fill(0.0);
        }
        let arch = Arch::new();
        arch.dispatch(ComputeProducts {
            products: &mut self.products,
            history,
        });
        arch.dispatch(ComputeBases {
            bases: &mut self.bases,
            products: &self.products,
        });
        arch.dispatch(ComputeDistances {
            distances: &mut self.distances,
            products: &self.products,
            bases: &self.bases,
            candidates: self.candidates,
            entries: &self.entries,
        });
        &self.distances.values()[..count * self.entries.len()]
    }

    /// dist(Aᵢ, B\[k\]) (equation 4), in [0, 1], of candidate `index` to each entry of the bag.
    pub fn distances(&self, index: usize) -> &[f64] {
        let entries = self.entries.len();
        &self.distances.values()[index * entries..(index + 1) * entries]
    }

    /// p̂(Aᵢ | B\[k\]) (equation 10) of candidate `index` for each entry of the bag; over the candidates they sum to 1.
    pub fn likelihoods(&self, index: usize) -> &[f64] {
        let entries = self.entries.len();
        &self.likelihoods[index * entries..(index + 1) * entries]
    }

    /// The weights of the N particles: equation 9, scaled to sum to 1.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The number of basis vectors in the subspace of candidate `index`.
    pub fn basis_dim(&self, index: usize) -> usize {
        self.bases.dim(index)
    }

    /// The most likely candidate (equation 12).
    pub fn best(&self) -> usize {
        likelihood::arg_max(&self.weights)
    }
}
