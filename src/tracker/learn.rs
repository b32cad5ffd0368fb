//! (C) What a session starts with, and what it learns from a frame.
//!
//! The order matters: the background first, since the bag's subspaces are those of vectors as the new metric sees them.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::tracker::motion::change_test::LastSeen;
use crate::tracker::appearance::background::{self, Background};
use crate::tracker::appearance::bag::{self, Bag};
use crate::tracker::motion::global_motion::Camera;
use crate::tracker::workspace::{self, Comparison};
use crate::tracker::classifier::ridge::{self, Discriminant};
use crate::tracker::motion::particles::{self, Draws, Particle, Reach};
use crate::tracker::image::frame_views::Pictures;
use crate::tracker::appearance::augmentation;
use crate::tracker::scale::pyramid;
use crate::tracker::scale::dsst::ScaleFilter;
use crate::tracker::confidence::score::Usual;
use crate::tracker::state::State;
use crate::tracker::confidence::update_gate::Trust;
use crate::tracker::estimate::Estimate;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::params::table::Params;
use crate::tracker::image::rect::Rect;
use crate::tracker::estimate::Status;

/// Areas around the first box that the discriminant starts from, and how far they are off: a third of them each of
/// these shares of the box (standard deviations), so that near misses, misses and the surroundings are all known.
const FIRST_EXAMPLES: usize = 300;
const FIRST_EXAMPLE_STDS: [f64; 3] = [0.1, 0.3, 0.8];
/// The same for the logarithm of their scale, as a share of those.
const FIRST_EXAMPLE_SCALES: f64 = 0.3;

/// Room for learning.
#[derive(Debug, Default)]
pub(crate) struct Room {
    areas: Vec<Particle>,
    features: Vec<f32>,
    pose: Vec<f32>,
    pub background: background::Room,
    pub bag: bag::Room,
    fit: ridge::Room,
    scale: pyramid::Room,
}

impl Room {
    /// Makes room for what `most` particles teach.
    pub fn begin(&mut self, most: usize) {
        workspace::empty(&mut self.fit.labels, most);
    }
}

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
        let mut state = Self {
            params,
            source,
            reach,
            estimate: given(0, target),
            answer,
            particles: Vec::new(),
            weights: Vec::new(),
            history: VecDeque::new(),
            bag: Bag::default(),
            background: Background::default(),
            discriminant: Discriminant::default(),
            camera,
            scale_filter: ScaleFilter::default(),
            last_seen: LastSeen::default(),
            trust: Trust::default(),
            usual: Usual::default(),
            turn: 0.0,
            frames_lost: 0,
        };
        state.gather(answer);
        state.survey(frame, 0, room);
        let Room { features, bag, .. } = &mut room.learning;
        state
            .bag
            .admit(features, &state.background, &state.params, bag);
        state.remember(features);
        state
    }

    /// Takes `target` (checked) as the box in `frame`, the next one.
    pub fn retarget(&mut self, frame: &GrayFrame, target: Rect, room: &mut Comparison) {
        let number = self.estimate.frame + 1;
        let (reach, answer) = Self::aim(self.source, &target);
        self.reach = reach;
        self.turn = 0.0;
        self.frames_lost = 0;
        self.gather(answer);
        if let Some(camera) = &mut self.camera {
            *camera = Camera::new(frame);
        }
        self.survey(frame, number, room);
        let Room { features, bag, .. } = &mut room.learning;
        self.bag.renew(&self.background, &self.params, bag);
        self.history.clear();
        self.trust = Trust::default();
        self.bag
            .point(features, &self.background, &self.params, bag);
        self.remember(features);
        self.estimate = given(number, target);
    }

    /// Learns everything that a box given by the user says about the surroundings, and looks at the box.
    fn survey(&mut self, frame: &GrayFrame, number: u64, room: &mut Comparison) {
        room.arrival.take(frame);
        self.see(&room.arrival);
        let everywhere = f64::from(frame.width().max(frame.height())) * 2.0;
        let pictures = Pictures::of(frame, self, &mut room.pictures);
        let frame = pictures.unturned();
        room.view
            .open(frame, &[self.answer], everywhere, &self.reach, &self.params);
        let mut draws = particles::generator(self.params.seed, number, Draws::Examples);
        let count = self.params.background_samples as usize;
        self.sample_background(frame, count, &mut draws, room);
        if self.params.discriminant_weight > 0.0 {
            self.begin_discriminant(frame, &mut draws, room);
        }
        self.scale_filter.forget();
        self.learn_scale(frame, room);
        self.look_at_answer(frame, room);
        self.look_at_poses(frame, room);
        pictures.give_back(&mut room.pictures);
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
            let mut fit = std::mem::take(&mut room.learning.fit);
            label_all(&room.particles, &self.answer, &self.reach, &mut fit.labels);
            self.discriminant
                .learn(&room.examples, room.vectors(), &self.params, &mut fit);
            room.learning.fit = fit;
        }
        self.learn_scale(frame, room);
        let wanted = Background::wanted(number, &self.params);
        if wanted > 0 {
            let mut draws = particles::generator(self.params.seed, number, Draws::Examples);
            self.sample_background(frame, wanted, &mut draws, room);
            let bag = &mut room.learning.bag;
            self.bag.renew(&self.background, &self.params, bag);
        }
        self.look_at_answer(frame, room);
        let Room { features, bag, .. } = &mut room.learning;
        if Bag::admits(number, &self.params) {
            // V: the answer and the previous frames (equation 2).
            for vector in &self.history {
                features.extend_from_slice(vector);
            }
            self.bag
                .admit(features, &self.background, &self.params, bag);
        }
        self.remember(features);
    }

    /// `found` with the scale that the filter measures there: against the last answer's, or `found`'s own without one.
    pub fn measure_scale(
        &self,
        frame: &GrayFrame,
        found: Particle,
        room: &mut Comparison,
    ) -> Particle {
        if !self.scale_filter.has_learned() {
            // The mean place of areas of many scales may be too far out for the mean of these.
            return self.reach.hold(found);
        }
        // What was out of sight may have come nearer.
        let center = if self.frames_lost > 0 {
            found
        } else {
            Particle {
                scale: self.answer.scale,
                ..found
            }
        };
        self.look_at_scales(frame, &center, room);
        let change = self.scale_filter.find(&mut room.learning.scale).believed();
        self.reach.hold(Particle {
            scale: center.scale * change.exp(),
            ..found
        })
    }

    fn learn_scale(&mut self, frame: &GrayFrame, room: &mut Comparison) {
        let rate = self.params.scale_rate;
        if rate > 0.0 {
            self.look_at_scales(frame, &self.answer, room);
            self.scale_filter.learn(&mut room.learning.scale, rate);
        }
    }

    /// Puts the pyramid around `center` into the room.
    fn look_at_scales(&self, frame: &GrayFrame, center: &Particle, room: &mut Comparison) {
        let pyramid::Room {
            areas, features, ..
        } = &mut room.learning.scale;
        pyramid::areas(center, areas);
        let params = pyramid::params(&self.params);
        room.view
            .features(frame, areas, &self.reach, &params, features);
    }

    /// The feature vector of the answer, as the first in the room.
    fn look_at_answer(&self, frame: &GrayFrame, room: &mut Comparison) {
        let features = &mut room.learning.features;
        let answer = [self.answer];
        room.view
            .features(frame, &answer, &self.reach, &self.params, features);
    }

    /// Appends the feature vectors of the answer in other poses. The view is of the last of these then.
    fn look_at_poses(&self, frame: &GrayFrame, room: &mut Comparison) {
        let (answer, params) = ([self.answer], &self.params);
        let Room { features, pose, .. } = &mut room.learning;
        for angle in augmentation::angles(params) {
            let turned = augmentation::turned(frame, &self.answer, angle);
            room.view.open(&turned, &answer, 0.0, &self.reach, params);
            room.view
                .features(&turned, &answer, &self.reach, params, pose);
            features.extend_from_slice(pose);
        }
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
        let Room {
            areas,
            features,
            background,
            ..
        } = &mut room.learning;
        background::areas(&self.answer, &self.reach, count, draws, areas);
        room.view
            .features(frame, areas, &self.reach, &self.params, features);
        self.background.renew(features, &self.params, background);
    }

    fn begin_discriminant(
        &mut self,
        frame: &GrayFrame,
        draws: &mut ChaCha8Rng,
        room: &mut Comparison,
    ) {
        if !self.discriminant.is_on() {
            let mut origin = self.background.mean().to_vec();
            origin.resize(self.params.feature_len(), 0.0);
            self.discriminant = Discriminant::new(origin);
        }
        let Room {
            areas,
            features,
            fit,
            ..
        } = &mut room.learning;
        first_examples(&self.answer, &self.reach, draws, areas);
        room.view
            .features(frame, areas, &self.reach, &self.params, features);
        room.examples.begin(&self.discriminant, &[], areas.len());
        room.examples.examine_alone(features);
        label_all(areas, &self.answer, &self.reach, &mut fit.labels);
        self.discriminant
            .begin(&room.examples, features, &self.params, fit);
    }
}

fn label_all(particles: &[Particle], target: &Particle, reach: &Reach, out: &mut Vec<f32>) {
    let label = |particle| ridge::label(particle, target, reach);
    out.clear();
    out.extend(particles.iter().map(label));
}

/// The target itself, and areas around it.
fn first_examples(
    target: &Particle,
    reach: &Reach,
    draws: &mut ChaCha8Rng,
    particles: &mut Vec<Particle>,
) {
    let mut normal = || -> f64 { StandardNormal.sample(draws) };
    particles.clear();
    particles.push(*target);
    for std in FIRST_EXAMPLE_STDS.iter().cycle().take(FIRST_EXAMPLES) {
        particles.push(reach.hold(Particle {
            x: target.x + std * reach.box_width * target.scale * normal(),
            y: target.y + std * reach.box_height * target.scale * normal(),
            scale: target.scale * (FIRST_EXAMPLE_SCALES * std * normal()).exp(),
        }));
    }
}
