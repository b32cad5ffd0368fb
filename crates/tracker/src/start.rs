//! What a session starts with: the models of the first frame, and of a frame in which the user corrects the box.

use rand_chacha::ChaCha8Rng;

use crate::appearance::background;
use crate::appearance::color_histogram::ColorHistogram;
use crate::appearance::model::Appearance;
use crate::classifier::labels;
use crate::classifier::ridge::Discriminant;
use crate::confidence::score::DistanceBaseline;
use crate::confidence::update_gate::UpdateGate;
use crate::estimate::{Estimate, Status};
use crate::expert::opinion::Expert;
use crate::expert::second_opinion::SecondOpinion;
use crate::features::extractor::Extractor;
use crate::image::frame::{Frame, FrameFormat};
use crate::image::rect::Rect;
use crate::image::warp::Rotation;
use crate::motion::global_motion::GlobalMotion;
use crate::motion::last_seen::LastSeen;
use crate::motion::random::{self, Draws};
use crate::motion::resampling::Cloud;
use crate::params::table::Params;
use crate::scale::dsst::ScaleFilter;
use crate::state::State;
use crate::workspace::{Learning, Scratch, Workspace};

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
    pub fn new(
        frame: &Frame,
        format: FrameFormat,
        target: Rect,
        params: Params,
        expert: Option<&dyn Expert>,
        workspace: &mut Workspace,
    ) -> Self {
        let source = frame.source_size();
        let (bounds, answer) = Self::place(source, format.size, &target);
        let mut state = Self {
            appearance: Appearance::new(&params),
            params,
            source,
            format,
            bounds,
            estimate: given(0, target),
            answer,
            cloud: None,
            discriminant: Discriminant::default(),
            global_motion: None,
            scale_filter: ScaleFilter::default(),
            color: ColorHistogram::default(),
            last_seen: LastSeen::default(),
            update_gate: UpdateGate::default(),
            baseline: DistanceBaseline::default(),
            orientation: 0.0,
            frames_lost: 0,
            second_opinion: None,
        };
        state.begin(frame, given(0, target), expert, workspace);
        state
    }

    /// Takes `target` (checked) as the box in `frame`, the next one.
    pub fn retarget(
        &mut self,
        frame: &Frame,
        target: Rect,
        expert: Option<&dyn Expert>,
        workspace: &mut Workspace,
    ) {
        let number = self.estimate.frame + 1;
        (self.bounds, self.answer) = Self::place(self.source, self.format.size, &target);
        self.orientation = 0.0;
        self.frames_lost = 0;
        self.begin(frame, given(number, target), expert, workspace);
    }

    /// Starts from the answer, which is the box `given` in `frame`. The bag keeps its entries.
    fn begin(
        &mut self,
        frame: &Frame,
        given: Estimate,
        expert: Option<&dyn Expert>,
        workspace: &mut Workspace,
    ) {
        let Workspace { views, scratch } = workspace;
        let image = self.working_view(frame, &mut views.downsampled);
        // All particles are at the answer, with equal weights.
        self.cloud = Cloud::at(self.answer, &self.params);
        let profiles = || GlobalMotion::new(frame);
        self.global_motion = self.params.global_motion.then(profiles);
        scratch.change_test.load(frame, &self.answer, &self.bounds);
        self.record_seen(scratch);
        self.init_models(image, given.frame, scratch);
        let Learning {
            features,
            appearance,
            ..
        } = &mut scratch.learning;
        let (extractor, params) = (&mut scratch.extractor, &self.params);
        extractor.features(image, &[self.answer], &self.bounds, params, features);
        self.describe_augmented(image, extractor, features);
        let model = self.appearance.model_mut();
        model.restart(features, &self.params, appearance);
        self.update_gate = UpdateGate::default();
        self.estimate = given;
        let area = self.bounds.area(&self.answer);
        self.second_opinion = expert.map(|expert| SecondOpinion::new(expert, frame, &area));
    }

    /// Fits the models of the target against its surroundings to a box that the user gave, in frame `number`.
    fn init_models(&mut self, image: &Frame, number: u64, scratch: &mut Scratch) {
        let (answer, bounds) = (self.answer, &self.bounds);
        let everywhere = 2.0 * bounds.frame_width.max(bounds.frame_height);
        scratch
            .extractor
            .compute_channels(image, &[answer], everywhere, bounds, &self.params);
        let mut draws = random::generator(self.params.seed, number, Draws::Samples);
        let samples = self.appearance.model().background_wanted(0, &self.params);
        if samples > 0 {
            let areas = &mut scratch.learning.areas;
            background::areas(&answer, &self.bounds, samples, &mut draws, areas);
            self.learn_background(image, scratch);
        }
        if self.params.discriminant_weight > 0.0 {
            self.init_discriminant(image, &mut draws, scratch);
        }
        self.color.reset();
        self.learn_color(image, &answer, scratch);
        self.scale_filter.reset();
        self.learn_scale(image, &answer, scratch);
    }

    /// Appends the feature vectors of the augmented views of the answer to `features`: copies rotated by some degrees
    /// either way. A subspace of one vector is a point; with these it spans what the target looks like when it tilts.
    /// The whole frame is rotated, so a copy shows the surroundings at its rim. Afterwards the extractor has the
    /// channels of the last copy.
    fn describe_augmented(
        &self,
        image: &Frame,
        extractor: &mut Extractor,
        features: &mut Vec<f32>,
    ) {
        let (answer, params) = ([self.answer], &self.params);
        let window = Extractor::window(&answer, 0.0, &self.bounds, params);
        let angle = params.augmentation_angle.to_radians();
        for angle in [angle, -angle].into_iter().filter(|it| *it != 0.0) {
            let rotation = Rotation::about((self.answer.x, self.answer.y), angle);
            let rotated = rotation.apply(image, &window, Frame::default());
            extractor.compute_channels(&rotated, &answer, 0.0, &self.bounds, params);
            let first = features.len();
            features.resize(first + params.feature_len(), 0.0);
            let view = &mut features[first..];
            extractor.describe(&rotated, &answer, &self.bounds, params, view);
        }
    }

    /// Fits the discriminant to the target and to areas around it.
    fn init_discriminant(&mut self, image: &Frame, draws: &mut ChaCha8Rng, scratch: &mut Scratch) {
        if !self.discriminant.is_on() {
            let mut origin = self.appearance.model().mean().to_vec();
            origin.resize(self.params.feature_len(), 0.0);
            self.discriminant = Discriminant::new(origin);
        }
        let learning = &mut scratch.learning;
        let (areas, features, fit) = (
            &mut learning.areas,
            &mut learning.features,
            &mut learning.fit,
        );
        labels::first_areas(&self.answer, &self.bounds, draws, areas);
        scratch
            .extractor
            .features(image, areas, &self.bounds, &self.params, features);
        let samples = &mut scratch.candidates.samples;
        let Discriminant { weights, origin } = &self.discriminant;
        samples.begin(weights, origin, &[], areas.len());
        samples.score_vectors(features);
        labels::label_all(areas, &self.answer, &self.bounds, &mut fit.labels);
        self.discriminant.begin(samples, features, fit);
    }
}
