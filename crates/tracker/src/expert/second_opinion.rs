//! What a session keeps of its expert, and where the expert looks next.

use serde::{Deserialize, Serialize};

use super::fusion::{self, Voice};
use super::opinion::Expert;
use crate::image::frame::Frame;
use crate::image::rect::Rect;

/// From this score of the filter on an expert that has gone elsewhere is put back to the filter's box.
const SURE: f32 = 0.95;
/// Below this score the expert is not sure.
const UNSURE_EXPERT: f32 = 0.5;
/// Boxes that overlap less than this are apart; the number is for how many frames in a row they may be.
const APART: f64 = 0.1;
const MAX_FRAMES_APART: u32 = 15;
/// Below this score the filter doubts its answer, and after so many frames it goes on from the expert's place.
const DOUBTED: f32 = 0.5;
const MAX_FRAMES_DOUBTED: u32 = 5;
/// The expert's box settles in so many looks at the first frame.
const FIRST_LOOKS: usize = 5;
/// The most by which an expert's box is taken to be larger or smaller than the target's, as a factor: an expert that is
/// off by more has not seen the first box.
const MAX_BIAS: f64 = 1.5;
/// The bound of the coordinates and sides of the expert's box, in longer sides of the frame.
const MAX_SIDES: f64 = 8.0;

/// An expert's part of a session's state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SecondOpinion {
    /// Which expert made the template.
    pub fingerprint: u64,
    template: Vec<f32>,
    /// The expert's last box, in working pixels.
    place: Rect,
    /// The width and height that the expert saw of the first box, divided by those of the first box.
    bias: (f64, f64),
    frames_apart: u32,
    frames_doubted: u32,
    /// Whether the filter alone had lost the target.
    pub filter_lost: bool,
}

/// What comes of asking the expert.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Consultation {
    /// The box that the filter and the expert give together, in working pixels.
    pub target: Rect,
    /// The chance that this box overlaps the target by half or more.
    pub score: f32,
    /// The centre, in working pixels, from which the filter goes on; none where it goes on from its own answer.
    pub moved: Option<(f64, f64)>,
}

impl SecondOpinion {
    /// Shows `expert` the target, which is in the box `target` of `frame`, in working pixels.
    pub fn new(expert: &dyn Expert, frame: &Frame, target: &Rect) -> Self {
        let template = expert.start(frame, target);
        let (x, y) = target.center();
        let mut place = *target;
        for _ in 0..FIRST_LOOKS {
            let seen = expert.look(frame, &template, &place).target;
            place = Rect::centered(x, y, seen.width, seen.height);
        }
        let bias = |seen: f64, given: f64| (seen / given).clamp(1.0 / MAX_BIAS, MAX_BIAS);
        let mut opinion = Self {
            fingerprint: expert.fingerprint(),
            template,
            place,
            bias: (
                bias(place.width, target.width),
                bias(place.height, target.height),
            ),
            frames_apart: 0,
            frames_doubted: 0,
            filter_lost: false,
        };
        opinion.put(target, frame);
        opinion
    }

    /// Makes the expert look next at the box `target`, which is without the expert's bias.
    fn put(&mut self, target: &Rect, frame: &Frame) {
        let ((x, y), (horizontal, vertical)) = (target.center(), self.bias);
        let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
        let longest = 4.0 * width.max(height);
        self.place = Rect::centered(
            x.clamp(0.0, width),
            y.clamp(0.0, height),
            (target.width * horizontal).clamp(1.0, longest),
            (target.height * vertical).clamp(1.0, longest),
        );
    }

    /// Asks `expert` about `frame` and fuses what it sees with `filter`, the filter's answer. A filter that is sure
    /// enough is followed without asking.
    pub fn consult(
        &mut self,
        expert: &dyn Expert,
        frame: &Frame,
        filter: &Voice,
        filter_lost: bool,
    ) -> Consultation {
        if filter.score >= expert.unasked_from() {
            return self.follow(frame, filter, filter_lost);
        }
        let sighting = expert.look(frame, &self.template, &self.place);
        let ((x, y), bias) = (sighting.target.center(), self.bias);
        let (width, height) = (
            sighting.target.width / bias.0,
            sighting.target.height / bias.1,
        );
        let unbiased = Rect::centered(x, y, width, height);
        self.put(&unbiased, frame);
        let (x, y) = self.place.center();
        let expert = Voice {
            target: Rect::centered(x, y, self.place.width / bias.0, self.place.height / bias.1),
            score: sighting.score,
        };
        let overlap = expert.target.overlap(&filter.target);
        self.frames_apart = if overlap < APART {
            self.frames_apart + 1
        } else {
            0
        };
        self.frames_doubted = if filter.score < DOUBTED {
            self.frames_doubted + 1
        } else {
            0
        };
        self.filter_lost = filter_lost;
        let target = fusion::fuse(filter, &expert);
        let score = fusion::score(filter, &expert);
        let is_unsure = sighting.score < UNSURE_EXPERT && overlap < APART;
        if filter.score >= SURE && (is_unsure || self.frames_apart >= MAX_FRAMES_APART) {
            self.put(&filter.target, frame);
            self.frames_apart = 0;
        }
        let moved = (self.frames_doubted >= MAX_FRAMES_DOUBTED).then(|| {
            self.frames_doubted = 0;
            expert.target.center()
        });
        Consultation {
            target,
            score,
            moved,
        }
    }

    /// The filter's own answer, at which the expert looks next.
    fn follow(&mut self, frame: &Frame, filter: &Voice, filter_lost: bool) -> Consultation {
        self.put(&filter.target, frame);
        (self.frames_apart, self.frames_doubted) = (0, 0);
        self.filter_lost = filter_lost;
        Consultation {
            target: filter.target,
            score: filter.score,
            moved: None,
        }
    }

    /// Whether it may be what a session keeps of an expert with templates of `len` numbers, in working images of this
    /// size.
    pub fn is_valid_for(&self, len: usize, (width, height): (u32, u32)) -> bool {
        let reach = MAX_SIDES * f64::from(width.max(height));
        let Rect {
            x,
            y,
            width,
            height,
        } = self.place;
        let is_bias = |bias: f64| (1.0 / MAX_BIAS..=MAX_BIAS).contains(&bias);
        self.template.len() == len
            && self.template.iter().all(|value| value.is_finite())
            && self.place.is_valid()
            && [x, y, width, height]
                .iter()
                .all(|value| value.abs() <= reach)
            && is_bias(self.bias.0)
            && is_bias(self.bias.1)
            && self.frames_apart <= MAX_FRAMES_APART
            && self.frames_doubted <= MAX_FRAMES_DOUBTED
    }
}
