//! What an expert is.

use std::fmt;

use crate::image::frame::Frame;
use crate::image::rect::Rect;

/// Finds a target in a frame, near a place, by what it noted of the target before. Boxes are in the pixels of the frame's
/// luma, which are those of the session's working image.
///
/// An expert has no memory: what it knows of a target is in the template that it made, so that many sessions share an
/// expert, and a snapshot carries all that a session needs of it. The same inputs give the same answers.
pub trait Expert: fmt::Debug + Send + Sync {
    /// Tells experts apart: two with the same fingerprint give the same answers.
    fn fingerprint(&self) -> u64;

    /// How many numbers a template has.
    fn template_len(&self) -> usize;

    /// What `frame` shows in the box `target`: [`template_len`](Self::template_len) finite numbers.
    fn start(&self, frame: &Frame, target: &Rect) -> Vec<f32>;

    /// Where the target of `template` is in `frame`, if it is near `place`, the box that it had before.
    fn look(&self, frame: &Frame, template: &[f32], place: &Rect) -> Sighting;
}

/// Where an expert sees the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// The box.
    pub target: Rect,
    /// How sure the expert is, in [0, 1]. What is usual differs from expert to expert.
    pub score: f32,
}
