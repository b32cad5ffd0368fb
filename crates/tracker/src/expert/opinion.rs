//! What an expert is.

use std::fmt;
use std::sync::Arc;

use crate::image::frame::Frame;
use crate::image::rect::Rect;

/// Finds a target in a frame, near a place, by what it noted of the target before. Boxes are in the pixels of the
/// frame's luma, which are those of the session's working image.
///
/// An expert has no memory: what it knows of a target is in the template that it made, so that many sessions share an
/// expert, and a snapshot carries all that a session needs of it. The same inputs give the same answers.
pub trait Expert: fmt::Debug + Send + Sync {
    /// Tells experts apart: two with the same fingerprint give the same answers.
    fn fingerprint(&self) -> u64;

    /// How many numbers a template has.
    fn template_len(&self) -> usize;

    /// The template of what `frame` shows in the box `target`: [`template_len`](Self::template_len) finite numbers.
    fn start(&self, frame: &Frame, target: &Rect) -> Vec<f32>;

    /// Where the target of `template` is in `frame`, if it is near `place`, the box that it had before.
    fn look(&self, frame: &Frame, template: &[f32], place: &Rect) -> Sighting;

    /// The score of the filter from which on the expert is not asked. Infinite where it is asked in every frame.
    fn unasked_from(&self) -> f32 {
        f32::INFINITY
    }
}

/// Below this score of the filter [`InDoubt`] asks its expert.
const IN_DOUBT: f32 = 0.95;
/// Makes the fingerprint of [`InDoubt`] another than that of its expert.
const IN_DOUBT_FINGERPRINT: u64 = 0x9e37_79b9_7f4a_7c15;

/// An expert that is asked only of frames in which the filter's score is below 0.95. In other frames the answer and the
/// score are the filter's, and a frame costs no more than without an expert.
#[derive(Debug, Clone)]
pub struct InDoubt(pub Arc<dyn Expert>);

impl Expert for InDoubt {
    fn fingerprint(&self) -> u64 {
        self.0.fingerprint() ^ IN_DOUBT_FINGERPRINT
    }

    fn template_len(&self) -> usize {
        self.0.template_len()
    }

    fn start(&self, frame: &Frame, target: &Rect) -> Vec<f32> {
        self.0.start(frame, target)
    }

    fn look(&self, frame: &Frame, template: &[f32], place: &Rect) -> Sighting {
        self.0.look(frame, template, place)
    }

    fn unasked_from(&self) -> f32 {
        IN_DOUBT
    }
}

/// Where an expert sees the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// The box, in pixels of the frame's luma.
    pub target: Rect,
    /// How sure the expert is, in [0, 1]. What is usual differs from expert to expert.
    pub score: f32,
}
