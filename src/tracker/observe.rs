//! What is seen of a frame: the displacement of the image, where the target is searched, and in which pixels.

use std::borrow::Cow;

use crate::tracker::appearance::background::{self, Background};
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::downsample::downsampled;
use crate::tracker::image::frame::Frame;
use crate::tracker::image::warp::Rotation;
use crate::tracker::motion::particles::Particle;
use crate::tracker::motion::search::SearchContext;
use crate::tracker::state::State;
use crate::tracker::workspace::Workspace;

impl State {
    /// The displacement of the whole image since the last frame, in working pixels.
    pub fn displacement(&mut self, frame: &Frame, workspace: &mut Workspace) -> (f64, f64) {
        match &mut self.global_motion {
            Some(profiles) => profiles.displacement(frame, &mut workspace.global_motion),
            None => (0.0, 0.0),
        }
    }

    /// The search in an image displaced by so much, in the view that `rotation` makes.
    pub fn search(
        &self,
        displacement: (f64, f64),
        rotation: Option<&Rotation>,
    ) -> SearchContext<'_> {
        SearchContext {
            last: self.answer,
            displacement: rotation.map_or(displacement, |rotation| {
                rotation.rotated_displacement(displacement)
            }),
            spread: self.spread(),
            params: &self.params,
            bounds: &self.bounds,
        }
    }

    /// How far around the last answer frame `number` is looked at, in working pixels.
    pub fn radius(&self, search: &SearchContext<'_>, number: u64) -> f64 {
        let samples = match Background::wanted(number, &self.params) {
            0 => 0.0,
            _ => background::radius(&self.answer, &self.bounds),
        };
        (search.radius() + samples).max(search.dense_radius())
    }

    /// `frame`, or the frame in larger pixels where the target is large. [`Workspace::give_back`] takes its memory
    /// again; otherwise the next frame allocates.
    pub fn view<'a>(&self, frame: &'a Frame, workspace: &mut Workspace) -> Cow<'a, Frame> {
        match Extractor::downsample_factor(&self.answer, &self.bounds, &self.params) {
            1 => Cow::Borrowed(frame),
            factor => {
                let scratch = std::mem::take(&mut workspace.downsampled);
                Cow::Owned(downsampled(frame, factor, scratch))
            }
        }
    }

    /// `view` with a rotated target upright, within the window of the search.
    pub fn rectified(
        &self,
        view: &Frame,
        rotation: Option<&Rotation>,
        radius: f64,
        workspace: &mut Workspace,
    ) -> Option<Frame> {
        let rotation = rotation?;
        let window = Extractor::window(&[self.answer], radius, &self.bounds, &self.params);
        let scratch = std::mem::take(&mut workspace.rectified);
        Some(rotation.apply(view, &window, scratch))
    }
}

/// `particle` of the rotated image where it is in the frame.
pub(crate) fn to_original(particle: Particle, rotation: Option<&Rotation>) -> Particle {
    rotation.map_or(particle, |rotation| {
        let (x, y) = rotation.to_original((particle.x, particle.y));
        Particle { x, y, ..particle }
    })
}
