//! What is seen at the particles of a frame, and how likely each of them is: (B) and (D) of one frame.
//!
//! A comparison is room for the numbers of one frame, a few megabytes at most, and means nothing from one frame to the
//! next. Sessions are many and threads few, so each thread has one (see [`with`]) and sessions have none.

use std::cell::RefCell;

use super::bag::Bag;
use super::discriminant::Discriminant;
use super::gradients::GradientSums;
use super::motion::{Particle, Reach};
use super::patch::PatchCutter;
use super::search::Sought;
use super::solitary::Solitary;
use super::state::State;
use super::{Evaluation, Features, GrayFrame, Params, Rect, likelihood};

/// How much larger than the last answer the areas of a frame may be: scales change by a few hundredths a frame.
const LARGER: f64 = 1.15;

/// Cuts feature vectors out of one frame.
#[derive(Debug, Default)]
pub(super) struct View {
    cutter: PatchCutter,
    gradients: GradientSums,
    exact: Vec<f64>,
}

impl View {
    /// Gets ready for areas around `center`, up to `furthest` working pixels from its centre and [`LARGER`] than it.
    pub fn open(
        &mut self,
        frame: &GrayFrame,
        center: &Particle,
        furthest: f64,
        reach: &Reach,
        params: &Params,
    ) {
        if params.features == Features::Gradients {
            let area = seen(center, reach, params);
            let (x, y) = area.center();
            let width = LARGER * area.width + 2.0 * furthest;
            let height = LARGER * area.height + 2.0 * furthest;
            self.gradients
                .compute(frame, &Rect::centered(x, y, width, height));
        }
    }

    /// Appends the feature vectors, of length D, of `particles` to `out`.
    pub fn features(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        reach: &Reach,
        params: &Params,
        out: &mut Vec<f32>,
    ) {
        let len = params.feature_len();
        let before = out.len();
        out.resize(before + particles.len() * len, 0.0);
        let vectors = out[before..].chunks_exact_mut(len);
        for (particle, vector) in particles.iter().zip(vectors) {
            let area = seen(particle, reach, params);
            match params.features {
                Features::Gray => {
                    self.exact.resize(len, 0.0);
                    self.cutter.cut(frame, &area, params, &mut self.exact);
                    for (value, exact) in vector.iter_mut().zip(&self.exact) {
                        *value = *exact as f32;
                    }
                }
                Features::Gradients => self.gradients.features(&area, params, vector),
            }
        }
    }
}

/// The area that is looked at for a particle: its box and the context around it.
fn seen(particle: &Particle, reach: &Reach, params: &Params) -> Rect {
    let area = reach.area(particle);
    let (x, y) = area.center();
    Rect::centered(
        x,
        y,
        area.width * params.context,
        area.height * params.context,
    )
}

/// The particles of a frame, and all that is computed of them.
#[derive(Debug, Default)]
pub(super) struct Comparison {
    pub view: View,
    pub particles: Vec<Particle>,
    /// What the discriminant sees at each particle.
    pub prepared: Vec<f32>,
    scores: Vec<f32>,
    vectors: Vec<f32>,
    room: Vec<f32>,
    solitary: Solitary,
    evaluation: Option<(Params, Evaluation)>,
    /// For each particle, its distance to each entry of the bag.
    distances: Vec<f64>,
    likelihoods: Vec<f64>,
    /// The weights of all particles; they sum to 1.
    pub weights: Vec<f64>,
}

thread_local! {
    static COMPARISON: RefCell<Comparison> = RefCell::default();
}

/// Runs `work` with this thread's comparison.
pub(super) fn with<T>(work: impl FnOnce(&mut Comparison) -> T) -> T {
    COMPARISON.with_borrow_mut(work)
}

impl Comparison {
    /// Forgets the last frame and takes the bag of `state`.
    pub fn begin(&mut self, state: &State) {
        self.particles.clear();
        self.prepared.clear();
        self.scores.clear();
        self.distances.clear();
        if state.params.candidate_alone {
            self.solitary.set_bag(&state.bag, &state.params);
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

    /// Looks at the particles from `first` on, and computes their distances and scores.
    pub fn extend(&mut self, frame: &GrayFrame, first: usize, state: &State) {
        let (params, len) = (&state.params, state.params.feature_len());
        self.vectors.clear();
        self.view.features(
            frame,
            &self.particles[first..],
            &state.reach,
            params,
            &mut self.vectors,
        );
        if state.discriminant.is_on() {
            let before = self.prepared.len();
            self.prepared.extend_from_slice(&self.vectors);
            let prepared = &mut self.prepared[before..];
            state.discriminant.prepare(prepared);
            let scores = prepared.chunks_exact(len);
            self.scores
                .extend(scores.map(|vector| state.discriminant.score(vector)));
        }
        let metric = state.background.metric();
        metric.apply(&mut self.vectors, len, params.unit_length, &mut self.room);
        if params.candidate_alone {
            self.solitary
                .distances(&self.vectors, params, &mut self.distances);
        } else if let Some((_, evaluation)) = &mut self.evaluation {
            let count = self.vectors.len() / len;
            for (index, vector) in self.vectors.chunks_exact(len).enumerate() {
                let candidate = evaluation.candidate_mut(index);
                for (to, from) in candidate.iter_mut().zip(vector) {
                    *to = f64::from(*from);
                }
            }
            // Candidates are diagonalised side by side: what another frame left there would change the last bits.
            for index in count..params.particles as usize {
                evaluation.candidate_mut(index).fill(0.0);
            }
            let mut history = state
                .history
                .iter()
                .flatten()
                .copied()
                .collect::<Vec<f32>>();
            metric.apply(&mut history, len, params.unit_length, &mut self.room);
            evaluation.compute_distances(&history.chunks_exact(len).collect::<Vec<_>>());
            for index in 0..count {
                self.distances
                    .extend_from_slice(evaluation.distances(index));
            }
        }
    }

    /// Weighs all particles: the sum of their likelihoods over the bag (equations 9 to 11), the prior of the place, the
    /// discriminant's score. Returns the most likely one (equation 12).
    pub fn weigh(&mut self, sought: &Sought<'_>, bag: &Bag, discriminant: &Discriminant) -> usize {
        let params = sought.params;
        let entries = bag.entries().len();
        likelihood::normalized(
            &self.distances,
            entries,
            params.sigma,
            &mut self.likelihoods,
        );
        let pinned = (params.pinned as usize, params.pinned_weight);
        likelihood::sum_rule(&self.likelihoods, entries, pinned, &mut self.weights);
        for (weight, particle) in self.weights.iter_mut().zip(&self.particles) {
            *weight *= sought.prior(particle);
        }
        if discriminant.is_on() {
            let factor = params.discriminant_weight;
            let most = self
                .scores
                .iter()
                .copied()
                .fold(f32::NEG_INFINITY, f32::max);
            for (weight, score) in self.weights.iter_mut().zip(&self.scores) {
                *weight *= (factor * f64::from(score - most)).exp();
            }
        }
        let total: f64 = self.weights.iter().sum();
        if total > 0.0 {
            self.weights.iter_mut().for_each(|weight| *weight /= total);
        } else {
            // Every product underflowed: nothing is known to be better.
            let equal = 1.0 / self.weights.len() as f64;
            self.weights.fill(equal);
        }
        likelihood::arg_max(&self.weights)
    }

    /// The distances of particle `index` to the entries of the bag.
    pub fn distances(&self, index: usize) -> &[f64] {
        let entries = self.distances.len() / self.particles.len();
        &self.distances[index * entries..][..entries]
    }
}
