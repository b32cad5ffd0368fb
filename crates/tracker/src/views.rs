//! The views of a frame: the displacement of the image, where the target is searched, and in which pixels.

use crate::appearance::background;
use crate::features::extractor::Extractor;
use crate::image::downsample::downsampled;
use crate::image::frame::Frame;
use crate::motion::orientation;
use crate::motion::search::SearchContext;
use crate::state::State;
use crate::workspace::{Scratch, ViewBuffers};

/// The views of a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Views<'a> {
    /// The frame, in larger pixels where the target is large.
    pub working: &'a Frame,
    /// `working`, rotated within the window of the search so that a rotated target is upright.
    pub rectified: &'a Frame,
}

impl State {
    /// The displacement of the whole image since the last frame, in working pixels.
    pub fn displacement(&mut self, frame: &Frame, scratch: &mut Scratch) -> (f64, f64) {
        let profiles = self.global_motion.as_mut();
        profiles.map_or((0.0, 0.0), |profiles| {
            profiles.displacement(frame, &mut scratch.global_motion)
        })
    }

    /// The search in frame `number`, whose image is displaced by so much.
    pub fn search(&self, number: u64, displacement: (f64, f64)) -> SearchContext<'_> {
        let rotation = orientation::rotation(&self.answer, self.orientation);
        let appearance = self.appearance.model();
        let samples_radius = match appearance.background_wanted(number, &self.params) {
            0 => 0.0,
            _ => background::radius(&self.answer, &self.bounds),
        };
        SearchContext {
            last: self.answer,
            displacement: rotation.map_or(displacement, |rotation| {
                rotation.rotated_displacement(displacement)
            }),
            rotation,
            spread: self.spread(),
            samples_radius,
            params: &self.params,
            bounds: &self.bounds,
        }
    }

    /// The views of `frame` for this search.
    pub fn views<'a>(
        &self,
        frame: &'a Frame,
        search: &SearchContext<'_>,
        buffers: &'a mut ViewBuffers,
    ) -> Views<'a> {
        let working = self.working_view(frame, &mut buffers.downsampled);
        let memory = &mut buffers.rectified;
        let rectified = search.rotation.map_or(working, |rotation| {
            let radius = search.window_radius();
            let window = Extractor::window(&[self.answer], radius, &self.bounds, &self.params);
            *memory = rotation.apply(working, &window, std::mem::take(memory));
            memory
        });
        Views { working, rectified }
    }

    /// `frame`, or the frame in larger pixels where the target is large.
    pub fn working_view<'a>(&self, frame: &'a Frame, memory: &'a mut Frame) -> &'a Frame {
        match Extractor::downsample_factor(&self.answer, &self.bounds, &self.params) {
            1 => frame,
            factor => {
                *memory = downsampled(frame, factor, std::mem::take(memory));
                memory
            }
        }
    }
}
