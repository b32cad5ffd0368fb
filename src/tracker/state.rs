//! What a session is: everything that a snapshot carries, and nothing else.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::tracker::appearance::background::Background;
use crate::tracker::appearance::bag::Bag;
use crate::tracker::classifier::ridge::Discriminant;
use crate::tracker::confidence::score::{DistanceBaseline, Evidence};
use crate::tracker::confidence::update_gate::{self, UpdateGate};
use crate::tracker::error::TrackerError;
use crate::tracker::estimate::Estimate;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::frame::working_size;
use crate::tracker::image::rect::Rect;
use crate::tracker::motion::change_test::{ChangeTest, LastSeen};
use crate::tracker::motion::global_motion::GlobalMotion;
use crate::tracker::motion::particles::{Particle, StateBounds};
use crate::tracker::params::table::Params;
use crate::tracker::scale::dsst::ScaleFilter;

/// The shortest side of a box, in pixels of the uploaded frame.
pub const LEAST_BOX_SIDE: f64 = 4.0;

/// By how much of its usual width the search grows in each frame in which the target is out of sight.
const WIDENING: f64 = 0.5;

/// How much better than what counts as lost a target must look that is found again.
const FOUND_MARGIN: f64 = 0.2;

/// The state of a tracker between two frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    pub params: Params,
    pub source: (u32, u32),
    pub bounds: StateBounds,
    pub estimate: Estimate,
    /// Where the target was found last.
    pub answer: Particle,
    /// The last particles; none where the next ones come from the answer.
    pub particles: Vec<Particle>,
    /// One for each particle, summing to 1.
    pub weights: Vec<f64>,
    /// The feature vectors of the last tracked frames, newest first, 1 to P of them.
    pub history: VecDeque<Vec<f32>>,
    pub bag: Bag,
    pub background: Background,
    pub discriminant: Discriminant,
    /// Where a shift of the picture is looked for.
    pub global_motion: Option<GlobalMotion>,
    pub scale_filter: ScaleFilter,
    pub last_seen: LastSeen,
    pub update_gate: UpdateGate,
    pub usual: DistanceBaseline,
    /// By how much the target is turned in the picture against the first look, in radians.
    pub orientation: f64,
    /// For how many frames the target has been out of sight.
    pub frames_lost: u32,
}

impl State {
    /// From uploaded to working pixels, along x and along y.
    pub fn to_working(source: (u32, u32)) -> (f64, f64) {
        let (width, height) = working_size(source.0, source.1);
        (
            f64::from(width) / f64::from(source.0),
            f64::from(height) / f64::from(source.1),
        )
    }

    /// The reach of particles around `target`, and the particle that is `target` itself.
    pub fn place(source: (u32, u32), target: &Rect) -> (StateBounds, Particle) {
        let (horizontal, vertical) = Self::to_working(source);
        let (width, height) = working_size(source.0, source.1);
        let area = target.scaled(horizontal, vertical);
        let bounds = StateBounds {
            frame_width: f64::from(width),
            frame_height: f64::from(height),
            box_width: area.width,
            box_height: area.height,
        };
        let (x, y) = area.center();
        (bounds, Particle { x, y, scale: 1.0 })
    }

    /// The box of `particle`, in pixels of the uploaded frame.
    pub fn target_of(&self, particle: &Particle) -> Rect {
        let (horizontal, vertical) = Self::to_working(self.source);
        self.bounds
            .area(particle)
            .scaled(1.0 / horizontal, 1.0 / vertical)
    }

    /// All particles at `particle`, with equal weights.
    pub fn reset_particles(&mut self, particle: Particle) {
        let count = self.params.stored_particles();
        self.answer = particle;
        self.particles = vec![particle; count];
        self.weights = vec![1.0 / count.max(1) as f64; count];
    }

    /// How many times as wide as usual the next search is. The longer a target is out of sight, the further it may have
    /// come, until the search covers the frame.
    pub fn search_scale(&self) -> f64 {
        let std = self
            .params
            .motion_std_x
            .max(self.params.motion_std_y)
            .max(1.0);
        let most = self.bounds.frame_width.max(self.bounds.frame_height) / 3.0 / std;
        let widened = 1.0 + WIDENING * f64::from(self.frames_lost);
        widened.min(most.max(1.0))
    }

    /// Whether the best particle is not the target. Once the target is out of sight the search covers much more, and
    /// finds more that looks a little like it: so to be found again takes a better score, and a look that is recognised.
    pub fn is_lost(&self, evidence: &Evidence) -> bool {
        let Some(score) = evidence.discriminant else {
            return false;
        };
        let (score, below) = (f64::from(score), self.params.lost_threshold);
        if self.frames_lost == 0 {
            return score < below;
        }
        let (update_gate, params) = (&self.update_gate, &self.params);
        score < below + FOUND_MARGIN
            || !update_gate.recognizes(evidence.first_distance, self.search_scale(), params)
    }

    /// Whether frame `number`, whose answer has `score`, is believed enough to be learned from. Without a discriminant a
    /// score is no chance.
    pub fn passes(&self, score: f32, number: u64) -> bool {
        !self.discriminant.is_on() || update_gate::passes(f64::from(score), number, &self.params)
    }

    /// The target is at the answer in the frame that `arrival` has taken.
    pub fn record_seen(&mut self, arrival: &ChangeTest) {
        if self.params.static_penalty > 0.0 {
            self.last_seen.record_seen(self.answer, arrival);
        }
    }

    /// Makes the first vector of `features` the newest of the history.
    pub fn push_history(&mut self, features: &[f32]) {
        let full = self.history.len() >= self.params.history as usize;
        let oldest = if full { self.history.pop_back() } else { None };
        let mut newest = oldest.unwrap_or_default();
        newest.clear();
        newest.extend_from_slice(&features[..self.params.feature_len()]);
        self.history.push_front(newest);
    }
}

/// Checks a box given in the pixels of an uploaded frame of size `source`: finite, at least [`LEAST_BOX_SIDE`] on each
/// side and at least one pixel of the working image, at most four times as large as the frame, and on the frame with
/// at least one pixel of its length and height.
pub(crate) fn check_target(source: (u32, u32), target: &Rect) -> Result<(), TrackerError> {
    let values = [target.x, target.y, target.width, target.height];
    if !values.iter().all(|value| value.is_finite()) {
        return Err(TrackerError::Target("is not finite"));
    }
    if target.width < LEAST_BOX_SIDE || target.height < LEAST_BOX_SIDE {
        return Err(TrackerError::Target(
            "is too small: each side must be at least 4 pixels",
        ));
    }
    let (horizontal, vertical) = State::to_working(source);
    if target.width * horizontal < 1.0 || target.height * vertical < 1.0 {
        return Err(TrackerError::Target(
            "is too small: each side must be at least 1/320 of the frame's longer side",
        ));
    }
    let (width, height) = (f64::from(source.0), f64::from(source.1));
    let limit = greatest_box_side(source);
    if target.width > limit || target.height > limit {
        return Err(TrackerError::Target(
            "is too large: no side may be over four times the frame's longer side",
        ));
    }
    // Neither pixel nor box is narrower than this.
    let touch = 1.0_f64;
    let across = (target.x + target.width).min(width) - target.x.max(0.0);
    let down = (target.y + target.height).min(height) - target.y.max(0.0);
    if across < touch || down < touch {
        return Err(TrackerError::Target(
            "is outside the frame: at least one pixel of it must be inside",
        ));
    }
    Ok(())
}

/// The longest side of a box, in pixels of uploaded frames of size `source`: four times the frame's longer side.
pub(crate) fn greatest_box_side(source: (u32, u32)) -> f64 {
    4.0 * f64::from(source.0.max(source.1)).max(LEAST_BOX_SIDE)
}

/// Checks that `frame` has the size of the session's frames.
pub(crate) fn check_frame(source: (u32, u32), frame: &GrayFrame) -> Result<(), TrackerError> {
    let (got_width, got_height) = frame.source_size();
    if (got_width, got_height) == source {
        return Ok(());
    }
    Err(TrackerError::FrameSize {
        width: source.0,
        height: source.1,
        got_width,
        got_height,
    })
}
