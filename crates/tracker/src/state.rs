//! What a session is: everything that a snapshot carries, and nothing else.

use serde::{Deserialize, Serialize};

use crate::appearance::color_histogram::ColorHistogram;
use crate::appearance::model::Appearance;
use crate::classifier::ridge::Discriminant;
use crate::confidence::score::DistanceBaseline;
use crate::confidence::update_gate::UpdateGate;
use crate::estimate::Estimate;
use crate::expert::second_opinion::SecondOpinion;
use crate::image::frame::FrameFormat;
use crate::image::rect::Rect;
use crate::input;
use crate::motion::global_motion::GlobalMotion;
use crate::motion::last_seen::LastSeen;
use crate::motion::particles::{Particle, StateBounds};
use crate::motion::resampling::Cloud;
use crate::params::table::Params;
use crate::scale::dsst::ScaleFilter;

/// By how much of its usual width the search widens in each frame in which the target is lost.
const WIDENING: f64 = 0.5;
/// Three standard deviations of the widest search, in sides √(width · height) of the target. A wider search costs more,
/// and finds look-alikes.
const MAX_SEARCHED_SIDES: f64 = 5.0;

/// The state of a tracker between two frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    pub params: Params,
    /// Width and height of the uploaded frames.
    pub source: (u32, u32),
    /// How the session's frames are seen: decided by the first frame and its box.
    pub format: FrameFormat,
    pub bounds: StateBounds,
    pub estimate: Estimate,
    /// Where the target was found last.
    pub answer: Particle,
    /// The last particles; none where the next ones are drawn around the answer.
    pub cloud: Option<Cloud>,
    pub appearance: Appearance,
    pub discriminant: Discriminant,
    /// The profiles of the last frame, with `global_motion`.
    pub global_motion: Option<GlobalMotion>,
    pub scale_filter: ScaleFilter,
    pub color: ColorHistogram,
    pub last_seen: LastSeen,
    pub update_gate: UpdateGate,
    pub baseline: DistanceBaseline,
    /// The target's in-plane rotation against the first frame, in radians.
    pub orientation: f64,
    /// For how many frames nothing has spoken for the box of a lost target, less those in which its particles did.
    pub frames_lost: u32,
    /// What the session keeps of its expert, if it has one. A snapshot carries it after the other fields.
    #[serde(skip)]
    pub second_opinion: Option<SecondOpinion>,
}

impl State {
    /// The bounds of particles around `target` in working images of this size, and the particle that is `target`
    /// itself.
    pub fn place(
        source: (u32, u32),
        (width, height): (u32, u32),
        target: &Rect,
    ) -> (StateBounds, Particle) {
        let (horizontal, vertical) = input::to_working(source, (width, height));
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
        let (horizontal, vertical) = input::to_working(self.source, self.format.size);
        self.bounds
            .area(particle)
            .scaled(1.0 / horizontal, 1.0 / vertical)
    }

    /// How many times as wide as usual the next search is. The longer a target is lost, the further it may have come,
    /// until the search covers the whole frame or [`MAX_SEARCHED_SIDES`].
    pub fn spread(&self) -> f64 {
        let std = self.params.motion_std_x.max(self.params.motion_std_y);
        let frame = self.bounds.frame_width.max(self.bounds.frame_height);
        let widest = frame.min(MAX_SEARCHED_SIDES * self.bounds.side(&self.answer));
        let max = (widest / 3.0 / std.max(1.0)).max(1.0);
        (1.0 + WIDENING * f64::from(self.frames_lost)).min(max)
    }
}
