//! What a session is: everything that a snapshot carries, and nothing else.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::bag::Bag;
use super::eigen::Spectrum;
use super::frame::working_size;
use super::motion::{Particle, Reach};
use super::score::Usual;
use super::{Estimate, GrayFrame, Params, Rect, TrackerError};

/// The shortest side of a box, in pixels of the uploaded frame.
pub const LEAST_BOX_SIDE: f64 = 4.0;

/// The longest history that parameters allow.
const MOST_PATCHES: usize = 10;

/// The state of a tracker between two frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    pub params: Params,
    pub source: (u32, u32),
    pub reach: Reach,
    pub estimate: Estimate,
    pub particles: Vec<Particle>,
    /// One for each particle, summing to 1.
    pub weights: Vec<f64>,
    /// The tracked patches of the last frames, newest first, 1 to P of them.
    pub history: VecDeque<Vec<f32>>,
    pub bag: Bag,
    pub usual: Usual,
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
    pub fn aim(source: (u32, u32), target: &Rect) -> (Reach, Particle) {
        let (horizontal, vertical) = Self::to_working(source);
        let (width, height) = working_size(source.0, source.1);
        let area = target.scaled(horizontal, vertical);
        let reach = Reach {
            frame_width: f64::from(width),
            frame_height: f64::from(height),
            box_width: area.width,
            box_height: area.height,
        };
        let (x, y) = area.center();
        (reach, Particle { x, y, scale: 1.0 })
    }

    /// The box of `particle`, in pixels of the uploaded frame.
    pub fn target_of(&self, particle: &Particle) -> Rect {
        let (horizontal, vertical) = Self::to_working(self.source);
        self.reach
            .area(particle)
            .scaled(1.0 / horizontal, 1.0 / vertical)
    }

    /// All particles at `particle`, with equal weights.
    pub fn gather(&mut self, particle: Particle) {
        let count = self.params.particles as usize;
        self.particles = vec![particle; count];
        self.weights = vec![1.0 / count as f64; count];
    }

    /// Calls `work` with the previous patches, newest first.
    pub fn with_history<T>(&self, work: impl FnOnce(&[&[f32]]) -> T) -> T {
        let mut slots: [&[f32]; MOST_PATCHES] = [&[]; MOST_PATCHES];
        for (slot, patch) in slots.iter_mut().zip(&self.history) {
            *slot = patch;
        }
        work(&slots[..self.history.len()])
    }

    /// Puts the subspace of `patch` and the previous patches (equation 2) into the bag.
    pub fn admit(&mut self, patch: &[f32], spectrum: &mut Spectrum) {
        let mut vectors = [patch; MOST_PATCHES + 1];
        for (slot, previous) in vectors[1..].iter_mut().zip(&self.history) {
            *slot = previous;
        }
        let vectors = &vectors[..=self.history.len()];
        self.bag.admit(vectors, &self.params, spectrum);
    }

    /// Makes `patch` the newest of the history, in the room of the oldest.
    pub fn remember(&mut self, patch: &[f32]) {
        let mut newest = Vec::new();
        while self.history.len() >= self.params.history as usize {
            newest = self.history.pop_back().unwrap_or_default();
        }
        newest.clear();
        newest.extend_from_slice(patch);
        self.history.push_front(newest);
    }
}

/// Checks a box given in the pixels of an uploaded frame of size `source`: finite, at least [`LEAST_BOX_SIDE`] on each
/// side and at least one pixel of the working image, at most four times as large as the frame, and on the frame with
/// at least one pixel of its length and height.
pub(super) fn check_target(source: (u32, u32), target: &Rect) -> Result<(), TrackerError> {
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
pub(super) fn greatest_box_side(source: (u32, u32)) -> f64 {
    4.0 * f64::from(source.0.max(source.1)).max(LEAST_BOX_SIDE)
}

/// Checks that `frame` has the size of the session's frames.
pub(super) fn check_frame(source: (u32, u32), frame: &GrayFrame) -> Result<(), TrackerError> {
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
