//! (C) What a session starts with, and what it learns from a frame.
//!
//! The order matters: the background first, since the bag's subspaces are those of vectors as the new metric sees them.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::tracker::appearance::augmentation;
use crate::tracker::appearance::background::{self, Background};
use crate::tracker::appearance::bag::{self, Bag};
use crate::tracker::classifier::ridge::{self, Discriminant};
use crate::tracker::confidence::score::DistanceBaseline;
use crate::tracker::confidence::update_gate::UpdateGate;
use crate::tracker::estimate::Estimate;
use crate::tracker::estimate::Status;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::frame_views::FrameViews;
use crate::tracker::image::rect::Rect;
use crate::tracker::motion::change_test::LastSeen;
use crate::tracker::motion::global_motion::GlobalMotion;
use crate::tracker::motion::particles::{self, Draws, Particle, StateBounds};
use crate::tracker::params::table::Params;
use crate::tracker::scale::dsst::ScaleFilter;
use crate::tracker::scale::pyramid;
use crate::tracker::state::State;
use crate::tracker::workspace::{self, Workspace};

/// Areas around the first box that the discriminant starts from, and how far they are off: a third of them each of
/// these shares of the box (standard deviations), so that near misses, misses and the surroundings are all known.
const FIRST_EXAMPLES: usize = 300;
const FIRST_EXAMPLE_STDS: [f64; 3] = [0.1, 0.3, 0.8];
/// The same for the logarithm of their scale, as a share of those.
const FIRST_EXAMPLE_SCALES: f64 = 0.3;

/// Room for learning.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    areas: Vec<Particle>,
    features: Vec<f32>,
    pose: Vec<f32>,
    pub background: background::Scratch,
    pub bag: bag::Scratch,
    fit: ridge::Scratch,
    scale: pyramid::Scratch,
}

impl Scratch {
    /// Makes room for what `most` particles teach.
    pub fn begin(&mut self, most: usize) {
        workspace::clear_and_reserve(&mut self.fit.labels, most);
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
    pub fn new(frame: &GrayFrame, target: Rect, params: Params, workspace: &mut Workspace) -> Self {
        let source = frame.source_size();
        let (bounds, answer) = Self::place(source, &target);
        let global_motion = params.global_motion.then(|| GlobalMotion::new(frame));
        let mut state = Self {
            params,
            source,
            bounds,
            estimate: given(0, target),
            answer,
            particles: Vec::new(),
            weights: Vec::new(),
            history: VecDeque::new(),
            bag: Bag::default(),
            background: Background::default(),
            discriminant: Discriminant::default(),
            global_motion,
            scale_filter: ScaleFilter::default(),
            last_seen: LastSeen::default(),
            update_gate: UpdateGate::default(),
            usual: DistanceBaseline::default(),
            orientation: 0.0,
            frames_lost: 0,
        };
        state.reset_particles(answer);
        state.init_models(frame, 0, workspace);
        let Scratch { features, bag, .. } = &mut workspace.learning;
        state
            .bag
            .admit(features, &state.background, &state.params, bag);
        state.push_history(features);
        state
    }

    /// Takes `target` (checked) as the box in `frame`, the next one.
    pub fn retarget(&mut self, frame: &GrayFrame, target: Rect, workspace: &mut Workspace) {
        let number = self.estimate.frame + 1;
        let (bounds, answer) = Self::place(self.source, &target);
        self.bounds = bounds;
        self.orientation = 0.0;
        self.frames_lost = 0;
        self.reset_particles(answer);
        if let Some(global_motion) = &mut self.global_motion {
            *global_motion = GlobalMotion::new(frame);
        }
        self.init_models(frame, number, workspace);
        let Scratch { features, bag, .. } = &mut workspace.learning;
        self.bag.rebuild(&self.background, &self.params, bag);
        self.history.clear();
        self.update_gate = UpdateGate::default();
        self.bag
            .admit_pinned(features, &self.background, &self.params, bag);
        self.push_history(features);
        self.estimate = given(number, target);
    }

    /// Learns everything that a box given by the user says about the surroundings, and looks at the box.
    fn init_models(&mut self, frame: &GrayFrame, number: u64, workspace: &mut Workspace) {
        workspace.arrival.take(frame);
        self.record_seen(&workspace.arrival);
        let everywhere = f64::from(frame.width().max(frame.height())) * 2.0;
        let views = FrameViews::of(frame, self, &mut workspace.views);
        let frame = views.original();
        workspace.extractor.compute_channels(
            frame,
            &[self.answer],
            everywhere,
            &self.bounds,
            &self.params,
        );
        let mut draws = particles::generator(self.params.seed, number, Draws::TrainingSamples);
        let count = self.params.background_samples as usize;
        self.sample_background(frame, count, &mut draws, workspace);
        if self.params.discriminant_weight > 0.0 {
            self.begin_discriminant(frame, &mut draws, workspace);
        }
        self.scale_filter.forget();
        self.learn_scale(frame, workspace);
        self.look_at_answer(frame, workspace);
        self.look_at_poses(frame, workspace);
        views.give_back(&mut workspace.views);
    }

    /// How far from the answer frame `number` is looked at for the sake of learning, in working pixels.
    pub fn sampling_radius(&self, number: u64) -> f64 {
        if Background::wanted(number, &self.params) == 0 {
            return 0.0;
        }
        background::radius(&self.answer, &self.bounds)
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
    pub fn learn(&mut self, frame: &GrayFrame, number: u64, workspace: &mut Workspace) {
        if self.discriminant.is_on() {
            let mut fit = std::mem::take(&mut workspace.learning.fit);
            label_all(
                &workspace.particles,
                &self.answer,
                &self.bounds,
                &mut fit.labels,
            );
            self.discriminant.learn(
                &workspace.examples,
                workspace.vectors(),
                &self.params,
                &mut fit,
            );
            workspace.learning.fit = fit;
        }
        self.learn_scale(frame, workspace);
        let wanted = Background::wanted(number, &self.params);
        if wanted > 0 {
            let mut draws = particles::generator(self.params.seed, number, Draws::TrainingSamples);
            self.sample_background(frame, wanted, &mut draws, workspace);
            let bag = &mut workspace.learning.bag;
            self.bag.rebuild(&self.background, &self.params, bag);
        }
        self.look_at_answer(frame, workspace);
        let Scratch { features, bag, .. } = &mut workspace.learning;
        if Bag::admits(number, &self.params) {
            // V: the answer and the previous frames (equation 2).
            for vector in &self.history {
                features.extend_from_slice(vector);
            }
            self.bag
                .admit(features, &self.background, &self.params, bag);
        }
        self.push_history(features);
    }

    /// `found` with the scale that the filter measures there: against the last answer's, or `found`'s own without one.
    pub fn measure_scale(
        &self,
        frame: &GrayFrame,
        found: Particle,
        workspace: &mut Workspace,
    ) -> Particle {
        if !self.scale_filter.has_learned() {
            // The mean place of areas of many scales may be too far out for the mean of these.
            return self.bounds.clamp(found);
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
        self.look_at_scales(frame, &center, workspace);
        let maximum = self.scale_filter.find(&mut workspace.learning.scale);
        self.bounds.clamp(Particle {
            scale: center.scale * maximum.gated_change().exp(),
            ..found
        })
    }

    fn learn_scale(&mut self, frame: &GrayFrame, workspace: &mut Workspace) {
        let rate = self.params.scale_learning_rate;
        if rate > 0.0 {
            self.look_at_scales(frame, &self.answer, workspace);
            self.scale_filter.learn(&mut workspace.learning.scale, rate);
        }
    }

    /// Puts the pyramid around `center` into the room.
    fn look_at_scales(&self, frame: &GrayFrame, center: &Particle, workspace: &mut Workspace) {
        let pyramid::Scratch {
            areas, features, ..
        } = &mut workspace.learning.scale;
        pyramid::areas(center, areas);
        let params = pyramid::params(&self.params);
        workspace
            .extractor
            .features(frame, areas, &self.bounds, &params, features);
    }

    /// The feature vector of the answer, as the first in the room.
    fn look_at_answer(&self, frame: &GrayFrame, workspace: &mut Workspace) {
        let features = &mut workspace.learning.features;
        let answer = [self.answer];
        workspace
            .extractor
            .features(frame, &answer, &self.bounds, &self.params, features);
    }

    /// Appends the feature vectors of the answer in other poses. The view is of the last of these then.
    fn look_at_poses(&self, frame: &GrayFrame, workspace: &mut Workspace) {
        let (answer, params) = ([self.answer], &self.params);
        let Scratch { features, pose, .. } = &mut workspace.learning;
        for angle in augmentation::angles(params) {
            let rotated = augmentation::rotated(frame, &self.answer, angle);
            workspace
                .extractor
                .compute_channels(&rotated, &answer, 0.0, &self.bounds, params);
            workspace
                .extractor
                .features(&rotated, &answer, &self.bounds, params, pose);
            features.extend_from_slice(pose);
        }
    }

    fn sample_background(
        &mut self,
        frame: &GrayFrame,
        count: usize,
        draws: &mut ChaCha8Rng,
        workspace: &mut Workspace,
    ) {
        if count == 0 {
            return;
        }
        let Scratch {
            areas,
            features,
            background,
            ..
        } = &mut workspace.learning;
        background::areas(&self.answer, &self.bounds, count, draws, areas);
        workspace
            .extractor
            .features(frame, areas, &self.bounds, &self.params, features);
        self.background.rebuild(features, &self.params, background);
    }

    fn begin_discriminant(
        &mut self,
        frame: &GrayFrame,
        draws: &mut ChaCha8Rng,
        workspace: &mut Workspace,
    ) {
        if !self.discriminant.is_on() {
            let mut origin = self.background.mean().to_vec();
            origin.resize(self.params.feature_len(), 0.0);
            self.discriminant = Discriminant::new(origin);
        }
        let Scratch {
            areas,
            features,
            fit,
            ..
        } = &mut workspace.learning;
        first_examples(&self.answer, &self.bounds, draws, areas);
        workspace
            .extractor
            .features(frame, areas, &self.bounds, &self.params, features);
        workspace
            .examples
            .begin(&self.discriminant, &[], areas.len());
        workspace.examples.score_vectors(features);
        label_all(areas, &self.answer, &self.bounds, &mut fit.labels);
        self.discriminant
            .begin(&workspace.examples, features, &self.params, fit);
    }
}

fn label_all(particles: &[Particle], target: &Particle, bounds: &StateBounds, out: &mut Vec<f32>) {
    let label = |particle| ridge::label(particle, target, bounds);
    out.clear();
    out.extend(particles.iter().map(label));
}

/// The target itself, and areas around it.
fn first_examples(
    target: &Particle,
    bounds: &StateBounds,
    draws: &mut ChaCha8Rng,
    particles: &mut Vec<Particle>,
) {
    let mut normal = || -> f64 { StandardNormal.sample(draws) };
    particles.clear();
    particles.push(*target);
    for std in FIRST_EXAMPLE_STDS.iter().cycle().take(FIRST_EXAMPLES) {
        particles.push(bounds.clamp(Particle {
            x: target.x + std * bounds.box_width * target.scale * normal(),
            y: target.y + std * bounds.box_height * target.scale * normal(),
            scale: target.scale * (FIRST_EXAMPLE_SCALES * std * normal()).exp(),
        }));
    }
}
