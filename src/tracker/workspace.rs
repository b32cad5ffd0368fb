//! What is seen at the particles of a frame, and how likely each of them is: (B) and (D) of one frame.
//!
//! A comparison is room for the numbers of one frame, a few megabytes at most, and means nothing from one frame to the
//! next. Sessions are many and threads few, so each thread has one (see [`with`]) and sessions have none.

use std::cell::RefCell;
use std::ops::Range;

use crate::tracker::appearance::point_distance::PointDistance;
use crate::tracker::classifier::dense_search::DenseSearch;
use crate::tracker::classifier::samples::TrainingSamples;
use crate::tracker::confidence::score::Evidence;
use crate::tracker::confidence::update_gate::UpdateGate;
use crate::tracker::evaluation::Evaluation;
use crate::tracker::features::centering::Centering;
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::frame_views;
use crate::tracker::image::warp::Rotation;
use crate::tracker::learn;
use crate::tracker::motion::change_test::ChangeTest;
use crate::tracker::motion::global_motion::GlobalMotion;
use crate::tracker::motion::orientation;
use crate::tracker::motion::particles::Particle;
use crate::tracker::motion::proposal::SearchContext;
use crate::tracker::params::table::Features;
use crate::tracker::params::table::Params;
use crate::tracker::state::State;
use crate::tracker::weights::likelihood;
use crate::tracker::weights::posterior::Posterior;

/// P at most.
const MAX_HISTORY: usize = 10;

/// What is taken off all vectors: where candidates stand alone, the mean of the background.
fn offset(state: &State) -> &[f32] {
    if state.params.single_vector_candidate {
        state.background.mean()
    } else {
        &[]
    }
}

/// Whether candidates go into the printed evaluation as they are cut: no other vector is made of them.
fn is_printed(params: &Params) -> bool {
    params.features == Features::Gray
        && !params.single_vector_candidate
        && !params.unit_length
        && params.background_samples == 0
        && params.discriminant_weight <= 0.0
}

/// The particles of a frame, and all that is computed of them.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    pub extractor: Extractor,
    /// For pictures that are turned.
    rotated_view: Extractor,
    /// For the pictures in which the target is looked for, and the pixels of those that are turned further.
    pub views: frame_views::Scratch,
    tried_pixels: Vec<u8>,
    pub particles: Vec<Particle>,
    /// For sums of weights.
    pub sums: Vec<f64>,
    /// The feature vectors of all particles; where candidates stand alone, with the background's mean taken off.
    vectors: Vec<f32>,
    /// D.
    len: usize,
    /// Their squared lengths.
    squares: Vec<f32>,
    /// What the discriminant sees of them.
    pub examples: TrainingSamples,
    point_distance: PointDistance,
    whitened: Vec<f32>,
    products: Vec<f32>,
    evaluation: Option<(Params, Evaluation)>,
    /// For each particle, its distance to each entry of the bag.
    distances: Vec<f64>,
    /// How the picture is turned that the particles are in, if it is, and where they are in the picture itself.
    pub rotation: Option<Rotation>,
    to_original: Vec<Particle>,
    /// The exponent of each particle that its place alone says.
    places: Vec<f64>,
    posterior: Posterior,
    /// The weights of all particles; they sum to 1.
    pub weights: Vec<f64>,
    /// For what is learned from a frame.
    pub learning: learn::Scratch,
    /// For the profiles of a frame.
    pub global_motion: GlobalMotion,
    /// For what has come to the places of particles.
    pub arrival: ChangeTest,
    /// For the places that are looked at before particles are drawn.
    pub scan: DenseSearch,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

/// Runs `work` with this thread's comparison.
pub(crate) fn with<T>(work: impl FnOnce(&mut Workspace) -> T) -> T {
    WORKSPACE.with_borrow_mut(work)
}

/// Empties `workspace` and makes it large enough for `most`.
pub(crate) fn clear_and_reserve<T>(workspace: &mut Vec<T>, most: usize) {
    workspace.clear();
    workspace.reserve(most);
}

impl Workspace {
    /// Forgets the last frame, takes the bag of `state`, and makes room for `most` particles, so that the first search for
    /// a lost target finds it too.
    pub fn begin(&mut self, state: &State, most: usize) {
        let params = &state.params;
        let most = most + orientation::tried(params);
        self.len = params.feature_len();
        let values = self.vectors.len().max(most * self.len);
        self.vectors.resize(values, 0.0);
        let entries = params.bag_size as usize;
        clear_and_reserve(&mut self.particles, most);
        clear_and_reserve(&mut self.squares, most);
        clear_and_reserve(&mut self.distances, most * entries);
        clear_and_reserve(&mut self.places, most);
        clear_and_reserve(&mut self.to_original, most);
        if orientation::is_on(params) {
            self.views.begin(&state.bounds);
        }
        self.posterior.begin(most, entries);
        clear_and_reserve(&mut self.weights, most);
        let mean = offset(state);
        self.examples.begin(&state.discriminant, mean, most);
        self.learning.begin(most);
        if state.params.single_vector_candidate {
            self.point_distance
                .set_state(state, self.examples.query_vectors());
            return;
        }
        let seed = state.params.seed;
        let fits = |params: &Params| {
            Params {
                seed,
                ..params.clone()
            } == state.params
        };
        if !self
            .evaluation
            .as_ref()
            .is_some_and(|(params, _)| fits(params))
        {
            let evaluation = Evaluation::new(&state.params);
            self.evaluation = Some((state.params.clone(), evaluation));
        }
        if let Some((_, evaluation)) = &mut self.evaluation {
            evaluation.set_bag(state.bag.subspaces());
        }
    }

    /// The feature vectors of all particles; where candidates stand alone, with the background's mean taken off.
    pub fn vectors(&self) -> &[f32] {
        &self.vectors[..self.squares.len() * self.len]
    }

    /// Looks at the particles from `first` on, and computes their distances and scores.
    pub fn extend(&mut self, frame: &GrayFrame, first: usize, state: &State) {
        if is_printed(&state.params) {
            self.extend_printed(frame, first, state);
            return;
        }
        // The many of a wide search in batches as large as usual: those stay in the caches.
        let usual = state.params.first_particles();
        let batch = usual.max(state.params.particles as usize - usual);
        for first in (first..self.particles.len()).step_by(batch) {
            let end = self.particles.len().min(first + batch);
            self.extend_batch(frame, first..end, state);
        }
    }

    fn extend_batch(&mut self, frame: &GrayFrame, batch: Range<usize>, state: &State) {
        self.describe(frame, batch.clone(), state);
        self.compare(batch, state);
    }

    /// Writes the vectors of a batch.
    fn describe(&mut self, frame: &GrayFrame, batch: Range<usize>, state: &State) {
        let params = &state.params;
        let range = self.places(&batch);
        let particles = &self.particles[batch];
        let vectors = &mut self.vectors[range];
        let centering = Some(Centering {
            mean: offset(state),
            squares: &mut self.squares,
        });
        self.extractor
            .describe(frame, particles, &state.bounds, params, vectors, centering);
    }

    /// The distances and scores of a batch.
    fn compare(&mut self, batch: Range<usize>, state: &State) {
        let params = &state.params;
        let (first, range) = (batch.start, self.places(&batch));
        let vectors = &self.vectors[range.clone()];
        let squares = &self.squares[first..];
        if params.single_vector_candidate {
            self.point_distance
                .distances(vectors, squares, params, &mut self.distances);
            if state.discriminant.is_on() {
                let query_products = self.point_distance.query_products(squares.len());
                self.examples.push_scores(query_products, squares);
            }
            return;
        }
        if state.discriminant.is_on() {
            self.examples.score_vectors(vectors);
        }
        self.extend_whitened(range, state);
    }

    /// Compares particles as the paper does, without any other vector than the one cut out.
    fn extend_printed(&mut self, frame: &GrayFrame, first: usize, state: &State) {
        let Some((params, evaluation)) = &mut self.evaluation else {
            return;
        };
        let count = self.particles.len() - first;
        let candidates = &mut evaluation.candidates_mut()[..count * params.feature_len()];
        let particles = &self.particles[first..];
        self.extractor
            .cut(frame, particles, &state.bounds, params, candidates);
        let mut history = [&[][..]; MAX_HISTORY];
        for (slice, vector) in history.iter_mut().zip(&state.history) {
            *slice = vector;
        }
        let distances = evaluation.compute_distances(count, &history[..state.history.len()]);
        self.distances.extend_from_slice(distances);
    }

    /// Where the vectors of so many particles are.
    fn places(&self, particles: &Range<usize>) -> Range<usize> {
        particles.start * self.len..particles.end * self.len
    }

    /// Compares the vectors of a batch, and the history, whitened.
    fn extend_whitened(&mut self, batch: Range<usize>, state: &State) {
        let Some((_, evaluation)) = &mut self.evaluation else {
            return;
        };
        let (params, len) = (&state.params, state.params.feature_len());
        let whitening = state.background.whitening();
        let unit_length = params.unit_length;
        self.whitened.clear();
        self.whitened.extend_from_slice(&self.vectors[batch]);
        whitening.apply(&mut self.whitened, len, unit_length, &mut self.products);
        let count = self.whitened.len() / len;
        for (index, vector) in self.whitened.chunks_exact(len).enumerate() {
            evaluation.candidate_mut(index).copy_from_slice(vector);
        }
        self.whitened.clear();
        self.whitened.extend(state.history.iter().flatten());
        whitening.apply(&mut self.whitened, len, unit_length, &mut self.products);
        let mut history = [&[][..]; MAX_HISTORY];
        for (slice, vector) in history.iter_mut().zip(self.whitened.chunks_exact(len)) {
            *slice = vector;
        }
        let distances = evaluation.compute_distances(count, &history[..state.history.len()]);
        self.distances.extend_from_slice(distances);
    }

    /// What the places say of the particles that were not looked at before: their priors, and what has come there.
    fn look_at_places(&mut self, search: &SearchContext<'_>) {
        let known = self.places.len();
        let particles = &self.particles[known..];
        self.places.extend(search.priors(particles));
        let weight = search.params.static_penalty;
        if weight > 0.0 {
            let places = &mut self.places[known..];
            let mut particles = particles;
            if let Some(rotation) = &self.rotation {
                self.to_original.clear();
                let moved = particles.iter().map(|place| rotation.to_original(place));
                self.to_original.extend(moved);
                particles = &self.to_original;
            }
            self.arrival
                .discount(particles, search.bounds, weight, places);
        }
    }

    /// Weighs all particles: the sum of their likelihoods over the bag (equations 9 to 11), the prior of the place, the
    /// discriminant's score. Returns the most likely one (equation 12).
    pub fn weigh(&mut self, search: &SearchContext<'_>) -> usize {
        self.look_at_places(search);
        let mut weights = std::mem::take(&mut self.weights);
        weights.clear();
        weights.extend_from_slice(&self.places);
        self.weigh_from(0, search.params, search.params.sigma, &mut weights);
        self.weights = weights;
        likelihood::arg_max(&self.weights)
    }

    /// The same for the particles from `first` on alone: `weights` begin as what is known of them besides, as exponents.
    fn weigh_from(&mut self, first: usize, params: &Params, sigma: f64, weights: &mut [f64]) {
        // None where there is no discriminant.
        if let Some(scores @ [_, ..]) = self.examples.scores().get(first..) {
            let factor = params.discriminant_weight;
            let most = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            for (weight, score) in weights.iter_mut().zip(scores) {
                *weight += factor * f64::from(score - most);
            }
        }
        let pinned = (params.pinned as usize, params.pinned_weight);
        let entries = self.distances.len() / self.particles.len();
        let distances = &self.distances[first * entries..];
        self.posterior.weigh(distances, sigma, pinned, weights);
        let total: f64 = weights.iter().sum();
        if total > 0.0 {
            weights.iter_mut().for_each(|weight| *weight /= total);
        } else {
            // Every product underflowed: nothing is known to be better.
            let equal = 1.0 / weights.len() as f64;
            weights.fill(equal);
        }
    }

    /// Weighs what is at `place` in `frame` turned by each of `angles`, in radians: `weights` begin as the logarithms of their
    /// priors. The particles of the frame stay.
    pub fn weigh_rotated(
        &mut self,
        frame: &GrayFrame,
        place: &Particle,
        angles: &[f64],
        state: &State,
        weights: &mut [f64],
    ) {
        let first = self.particles.len();
        let entries = self.distances.len() / first;
        let (bounds, params) = (&state.bounds, &state.params);
        std::mem::swap(&mut self.extractor, &mut self.rotated_view);
        let window = Extractor::window(&[*place], 0.0, bounds, params);
        for &angle in angles {
            let pixels = std::mem::take(&mut self.tried_pixels);
            let rotated = Rotation::about(place, angle).apply(frame, &window, pixels);
            self.extractor
                .compute_channels(&rotated, &[*place], 0.0, bounds, params);
            let next = self.particles.len();
            self.particles.push(*place);
            self.describe(&rotated, next..next + 1, state);
            self.tried_pixels = rotated.into_pixels();
        }
        std::mem::swap(&mut self.extractor, &mut self.rotated_view);
        self.compare(first..self.particles.len(), state);
        self.weigh_from(first, params, orientation::SOFTER * params.sigma, weights);
        self.particles.truncate(first);
        self.squares.truncate(first);
        self.distances.truncate(first * entries);
        self.examples.truncate(first);
    }

    /// What particle `index` says about itself.
    pub fn evidence(&self, index: usize, update_gate: &UpdateGate) -> Evidence {
        let entries = self.distances.len() / self.particles.len();
        let distances = &self.distances[index * entries..][..entries];
        Evidence {
            first: distances[0],
            lately: update_gate.usual,
            nearest: distances.iter().copied().fold(f64::INFINITY, f64::min),
            discriminant: self.examples.scores().get(index).copied(),
            scale: self.particles[index].scale,
        }
    }
}
