//! (C) What a session starts with, and what it learns from a frame.
//!
//! The order matters: the background first, since the bag's subspaces are those of vectors as the new metric sees them.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::background::{self, Background};
use super::bag::{Bag, Entry};
use super::camera::Camera;
use super::comparison::Comparison;
use super::discriminant::{self, Discriminant};
use super::motion::{self, Draws, Particle, Reach};
use super::score::Usual;
use super::state::State;
use super::trust::Trust;
use super::{Estimate, GrayFrame, Params, Rect, Status};

/// Areas around the first box that the discriminant starts from, and how far they are off: a third of them each of
/// these shares of the box (standard deviations), so that near misses, misses and the surroundings are all known.
const FIRST_EXAMPLES: usize = 300;
const FIRST_EXAMPLE_STDS: [f64; 3] = [0.1, 0.3, 0.8];
/// The same for the logarithm of their scale, as a share of those.
const FIRST_EXAMPLE_SCALES: f64 = 0.3;

/// The answer to a frame whose box came from the user.
fn given(frame: u64, target: Rect) -> Estimate {
    Estimate {
        frame,
        target,
        score: 1.0,
        status: Status::Tracking,
    }
}

impl State {
    /// The state after the first frame, in which `target` (checked) is the box.
    pub fn new(frame: &GrayFrame, target: Rect, params: Params, room: &mut Comparison) -> Self {
        let source = frame.source_size();
        let (reach, answer) = Self::aim(source, &target);
        let camera = params.camera_shift.then(|| Camera::new(frame));
        let entry = Entry::new(
            &vec![0.0; params.feature_len()],
            &Default::default(),
            &params,
        );
        let mut state = Self {
            params,
            source,
            reach,
            estimate: given(0, target),
            answer,
            particles: Vec::new(),
            weights: Vec::new(),
            history: VecDeque::new(),
            bag: Bag::new(entry),
            background: Background::default(),
            discriminant: Discriminant::default(),
            camera,
            trust: Trust::default(),
            usual: Usual::default(),
        };
        state.gather(answer);
        let features = state.survey(frame, 0, room);
        state.bag = Bag::new(state.entry_with(&features));
        state.remember(features);
        state
    }

    /// Takes `target` (checked) as the box in `frame`, the next one.
    pub fn retarget(&mut self, frame: &GrayFrame, target: Rect, room: &mut Comparison) {
        let number = self.estimate.frame + 1;
        let (reach, answer) = Self::aim(self.source, &target);
        self.reach = reach;
        self.gather(answer);
        if let Some(camera) = &mut self.camera {
            *camera = Camera::new(frame);
        }
        let features = self.survey(frame, number, room);
        self.bag
            .rebuild_if_needed(self.background.metric(), &self.params);
        self.history.clear();
        self.trust = Trust::default();
        self.bag.point(self.entry_with(&features), &self.params);
        self.remember(features);
        self.estimate = given(number, target);
    }

    /// Learns everything that a box given by the user says about the surroundings; returns the box's features.
    fn survey(&mut self, frame: &GrayFrame, number: u64, room: &mut Comparison) -> Vec<f32> {
        let everywhere = f64::from(frame.width().max(frame.height())) * 2.0;
        room.view
            .open(frame, &self.answer, everywhere, &self.reach, &self.params);
        let mut draws = motion::generator(self.params.seed, number, Draws::Examples);
        let count = self.params.background_samples as usize;
        self.sample_background(frame, count, &mut draws, room);
        if self.params.discriminant_weight > 0.0 {
            self.begin_discriminant(frame, &mut draws, room);
        }
        self.features_of(frame, &[self.answer], room)
    }

    /// How far from the answer frame `number` is looked at for the sake of learning, in working pixels.
    pub fn learning_radius(&self, number: u64) -> f64 {
        if Background::wanted(number, &self.params) == 0 {
            return 0.0;
        }
        background::furthest(&self.answer, &self.reach)
    }

    /// Keeps the particles for the next frame, if those come from them.
    pub fn keep_particles(&mut self, particles: &[Particle], weights: &[f64]) {
        if self.params.stored_particles() > 0 {
            self.particles.clear();
            self.particles.extend_from_slice(particles);
            self.weights.clear();
            self.weights.extend_from_slice(weights);
        }
    }

    /// Learns from frame `number`, in which the target was found at the answer.
    pub fn learn(&mut self, frame: &GrayFrame, number: u64, room: &mut Comparison) {
        if self.discriminant.is_on() {
            let labels = labels(&room.particles, &self.answer, &self.reach);
            self.discriminant
                .learn(&room.prepared, &labels, &self.params);
        }
        let features = self.features_of(frame, &[self.answer], room);
        let wanted = Background::wanted(number, &self.params);
        if wanted > 0 {
            let mut draws = motion::generator(self.params.seed, number, Draws::Examples);
            self.sample_background(frame, wanted, &mut draws, room);
            self.bag
                .rebuild_if_needed(self.background.metric(), &self.params);
        }
        if Bag::admits(number, &self.params) {
            self.bag.admit(self.entry_with(&features), &self.params);
        }
        self.remember(features);
    }

    fn features_of(
        &self,
        frame: &GrayFrame,
        particles: &[Particle],
        room: &mut Comparison,
    ) -> Vec<f32> {
        let mut features = Vec::new();
        room.view
            .features(frame, particles, &self.reach, &self.params, &mut features);
        features
    }

    fn sample_background(
        &mut self,
        frame: &GrayFrame,
        count: usize,
        draws: &mut ChaCha8Rng,
        room: &mut Comparison,
    ) {
        if count == 0 {
            return;
        }
        let areas = background::areas(&self.answer, &self.reach, count, draws);
        let vectors = self.features_of(frame, &areas, room);
        self.background.renew(&vectors, &self.params);
    }

    fn begin_discriminant(
        &mut self,
        frame: &GrayFrame,
        draws: &mut ChaCha8Rng,
        room: &mut Comparison,
    ) {
        let particles = first_examples(&self.answer, &self.reach, draws);
        let mut vectors = self.features_of(frame, &particles, room);
        if !self.discriminant.is_on() {
            let len = self.params.feature_len();
            let mean = self.background.metric().mean();
            self.discriminant = Discriminant::new(if mean.is_empty() {
                vec![0.0; len]
            } else {
                mean.to_vec()
            });
        }
        self.discriminant.prepare(&mut vectors);
        let labels = labels(&particles, &self.answer, &self.reach);
        self.discriminant.begin(&vectors, &labels, &self.params);
    }
}

fn labels(particles: &[Particle], target: &Particle, reach: &Reach) -> Vec<f32> {
    let label = |particle| discriminant::label(particle, target, reach);
    particles.iter().map(label).collect()
}

/// The target itself, and areas around it.
fn first_examples(target: &Particle, reach: &Reach, draws: &mut ChaCha8Rng) -> Vec<Particle> {
    let mut normal = || -> f64 { StandardNormal.sample(draws) };
    let mut particles = vec![*target];
    for std in FIRST_EXAMPLE_STDS.iter().cycle().take(FIRST_EXAMPLES) {
        particles.push(reach.hold(Particle {
            x: target.x + std * reach.box_width * target.scale * normal(),
            y: target.y + std * reach.box_height * target.scale * normal(),
            scale: target.scale * (FIRST_EXAMPLE_SCALES * std * normal()).exp(),
        }));
    }
    particles
}
