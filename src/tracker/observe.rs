//! What is seen of a frame: the displacement of the image, where the target is searched, and in which view.

use crate::tracker::appearance::background::{self, Background};
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::Frame;
use crate::tracker::image::frame_views::FrameViews;
use crate::tracker::image::rect::Rect;
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

    /// The search for an image displaced by so much, in the view that `rotation` makes.
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

    /// The views of `frame`, the rectified one in the window of the search.
    pub fn views<'a>(
        &self,
        frame: &'a Frame,
        rotation: Option<&Rotation>,
        radius: f64,
        workspace: &mut Workspace,
    ) -> FrameViews<'a> {
        let mut views = FrameViews::new(frame, self.downsample_factor(), &mut workspace.views);
        if let Some(rotation) = rotation {
            let window = self.window(&self.answer, radius);
            views.rectify(rotation, &window, &mut workspace.views);
        }
        views
    }

    /// What is looked at around `center` and up to `radius` working pixels from it.
    pub fn window(&self, center: &Particle, radius: f64) -> Rect {
        Extractor::window(&[*center], radius, &self.bounds, &self.params)
    }

    /// How many working pixels along each side are one pixel of the views.
    pub fn downsample_factor(&self) -> usize {
        Extractor::downsample_factor(&self.answer, &self.bounds, &self.params)
    }
}

/// `particle` of the rotated image where it is in the frame.
pub(crate) fn to_original(particle: Particle, rotation: Option<&Rotation>) -> Particle {
    rotation.map_or(particle, |rotation| {
        let (x, y) = rotation.to_original((particle.x, particle.y));
        Particle { x, y, ..particle }
    })
}
