//! The candidates of a frame: its particles and, particle by particle, what is computed of them.
//!
//! The particles are described (B), compared with the bag (D) and weighed (equations 9 to 12), in this order, in one or
//! more rounds: each call works on the particles that were added since the last one.

use std::ops::Range;

use pulp::{Arch, Simd};

use crate::appearance::model::{Comparison, Vectors};
use crate::classifier::ridge::Discriminant;
use crate::classifier::samples::TrainingSamples;
use crate::confidence::score::Evidence;
use crate::features::extractor::Extractor;
use crate::image::frame::Frame;
use crate::image::warp::Rotation;
use crate::linalg::scratch::{AlignedBuffer, clear_and_reserve};
use crate::linalg::vector_ops;
use crate::motion::particles::Particle;
use crate::motion::search;
use crate::params::table::Params;
use crate::state::State;
use crate::weights::{self, Likelihoods};

/// Subtracts `mean` (nothing, where it is empty) from `vectors` of length `len`, and appends their squared lengths.
#[pulp::with_simd(center = Arch::new())]
#[inline(always)]
fn center_simd<S: Simd>(
    _: S,
    vectors: &mut [f32],
    len: usize,
    mean: &[f32],
    squares: &mut Vec<f32>,
) {
    for vector in vectors.chunks_exact_mut(len) {
        vector_ops::add(vector, -1.0, mean);
        squares.push(vector_ops::dot(vector, vector));
    }
}

/// The frame rotated about a particle, and its channels.
#[derive(Debug, Default)]
pub(crate) struct RotatedView {
    image: Frame,
    extractor: Extractor,
}

impl RotatedView {
    /// Becomes the view of `frame` in which a particle at `angle` radians is upright.
    pub fn rotate(&mut self, frame: &Frame, particle: Particle, angle: f64, state: &State) {
        let (bounds, params) = (&state.bounds, &state.params);
        let rotation = Rotation::about((particle.x, particle.y), angle);
        let window = Extractor::window(&[particle], 0.0, bounds, params);
        self.image = rotation.apply_within(frame, &window, std::mem::take(&mut self.image));
        self.extractor
            .compute_channels(&self.image, &[particle], 0.0, bounds, params);
    }
}

/// The particles of a frame, and all that is computed of them.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    pub particles: Vec<Particle>,
    /// The feature vectors, with the mean of the appearance model subtracted.
    vectors: AlignedBuffer<f32>,
    /// D, the length of a vector.
    len: usize,
    /// The squared lengths of the vectors.
    squares: Vec<f32>,
    /// The particles' scores of the discriminant.
    pub samples: TrainingSamples,
    comparison: Comparison,
    /// For each particle, its distance to each entry of the bag.
    distances: Vec<f64>,
    likelihoods: Likelihoods,
    /// The weights; they sum to 1.
    pub weights: Vec<f64>,
}

impl Candidates {
    /// Forgets the last frame, loads the models of `state`, and makes room for the widest search and `more` particles,
    /// so that the first search for a lost target does not allocate.
    pub fn begin(&mut self, state: &State, more: usize) {
        let params = &state.params;
        let (count, entries) = (search::max_count(params) + more, params.bag_size as usize);
        self.len = params.feature_len();
        self.vectors.resize(count * self.len);
        clear_and_reserve(&mut self.particles, count);
        clear_and_reserve(&mut self.squares, count);
        clear_and_reserve(&mut self.distances, count * entries);
        clear_and_reserve(&mut self.weights, count);
        self.likelihoods.reserve(count, entries);
        let model = state.appearance.model();
        let Discriminant { weights, origin } = &state.discriminant;
        self.samples.begin(weights, origin, model.mean(), count);
        model.load(self.samples.query_vectors(), params, &mut self.comparison);
    }

    /// The feature vectors of the particles that were described.
    pub fn vectors(&self) -> &[f32] {
        &self.vectors.values()[..self.squares.len() * self.len]
    }

    /// Describes the new particles in the channels that `extractor` computed of `image`, and compares them with the
    /// models of `state`. The many particles of a wide search come in batches of the usual size, which stay in the
    /// caches.
    pub fn describe_and_compare(
        &mut self,
        image: &Frame,
        extractor: &mut Extractor,
        state: &State,
    ) {
        let (all, first) = search::usual_counts(&state.params);
        let batch = first.max(all - first);
        for start in (self.squares.len()..self.particles.len()).step_by(batch) {
            let end = self.particles.len().min(start + batch);
            self.describe(image, extractor, start..end, state);
            self.compare(start..end, state);
        }
    }

    /// (B) The vectors of a batch.
    fn describe(
        &mut self,
        image: &Frame,
        extractor: &mut Extractor,
        batch: Range<usize>,
        state: &State,
    ) {
        let range = batch.start * self.len..batch.end * self.len;
        let particles = &self.particles[batch];
        let vectors = &mut self.vectors.values_mut()[range];
        extractor.describe(image, particles, &state.bounds, &state.params, vectors);
        let mean = state.appearance.model().mean();
        center(vectors, self.len, mean, &mut self.squares);
    }

    /// (D) The distances and the discriminant's scores of a batch.
    fn compare(&mut self, batch: Range<usize>, state: &State) {
        let candidates = Vectors {
            values: &self.vectors.values()[batch.start * self.len..batch.end * self.len],
            squares: &self.squares[batch.start..],
        };
        let (model, comparison) = (state.appearance.model(), &mut self.comparison);
        model.compare(candidates, &state.params, comparison, &mut self.distances);
        if state.discriminant.is_on() {
            let squares = candidates.squares;
            match model.query_products(squares.len(), comparison) {
                Some(products) => self.samples.push_scores(products, squares),
                None => self.samples.score_vectors(candidates.values),
            }
        }
    }

    /// Weighs all particles: the sum of their likelihoods over the bag (equations 9 to 11) times their priors, given as
    /// logarithms, times the discriminant's likelihood. Returns the most likely one (equation 12).
    pub fn posterior(&mut self, log_priors: &[f64], params: &Params) -> usize {
        let (weights, distances) = (&mut self.weights, &self.distances);
        weights.clear();
        weights.extend_from_slice(log_priors);
        add_scores(&self.samples.scores, params, weights);
        let pinned = (params.pinned_entries(), params.pinned_weight);
        let likelihoods = &mut self.likelihoods;
        weights::sum_rule_weights(likelihoods, distances, params.sigma, pinned, weights);
        weights::arg_max(weights)
    }

    /// The weights of one particle in several `views` of the frame, with these logarithmic priors and this σ. The
    /// particles of the frame stay as they are.
    pub fn posterior_in_views<const N: usize>(
        &mut self,
        particle: Particle,
        views: &mut [RotatedView; N],
        log_priors: [f64; N],
        sigma: f64,
        state: &State,
    ) -> [f64; N] {
        let (first, entries) = (self.particles.len(), self.entries());
        for view in views {
            self.particles.push(particle);
            self.describe_and_compare(&view.image, &mut view.extractor, state);
        }
        let mut weights = log_priors;
        let distances = &self.distances[first * entries..];
        let scores = self.samples.scores.get(first..).unwrap_or_default();
        add_scores(scores, &state.params, &mut weights);
        let pinned = (state.params.pinned_entries(), state.params.pinned_weight);
        let likelihoods = &mut self.likelihoods;
        weights::sum_rule_weights(likelihoods, distances, sigma, pinned, &mut weights);
        self.particles.truncate(first);
        self.squares.truncate(first);
        self.distances.truncate(first * entries);
        self.samples.truncate(first);
        weights
    }

    /// The distances of particle `index` to the entries of the bag.
    pub fn distances_of(&self, index: usize) -> &[f64] {
        &self.distances[index * self.entries()..][..self.entries()]
    }

    /// The distance of particle `index` to the first entry of the bag, which is that of the first box where it is
    /// pinned.
    pub fn first_distance_of(&self, index: usize) -> f64 {
        self.distances_of(index)[0]
    }

    /// The discriminant's score of particle `index`; none without a discriminant.
    pub fn score_of(&self, index: usize) -> Option<f32> {
        self.samples.scores.get(index).copied()
    }

    /// What particle `index` says of an answer of this scale; the running mean is that of the distance to the first
    /// entry.
    pub fn evidence(&self, index: usize, mean_first_distance: f64, scale: f64) -> Evidence {
        let distances = self.distances_of(index);
        Evidence {
            first_distance: self.first_distance_of(index),
            mean_first_distance,
            nearest_distance: distances.iter().copied().fold(f64::INFINITY, f64::min),
            discriminant: self.score_of(index),
            scale,
        }
    }

    /// The number of the bag's entries.
    fn entries(&self) -> usize {
        self.distances.len() / self.squares.len()
    }
}

/// Adds the logarithm of the discriminant's likelihood to `exponents`, the logarithms of priors; there are no scores
/// without a discriminant.
fn add_scores(scores: &[f32], params: &Params, exponents: &mut [f64]) {
    let max = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    for (exponent, score) in exponents.iter_mut().zip(scores) {
        *exponent += params.discriminant_weight * f64::from(score - max);
    }
}
