//! What is computed anew for each frame: a few megabytes that mean nothing from one frame to the next. Sessions are
//! many and threads few, so each thread has one workspace and sessions have none. A step that finds its thread's
//! workspace warm allocates nothing.

use std::borrow::Cow;
use std::cell::RefCell;

use crate::tracker::appearance::foreground_map::ForegroundMap;
use crate::tracker::appearance::{background, color_histogram, span};
use crate::tracker::candidates::Candidates;
use crate::tracker::classifier::dense_search::DenseSearch;
use crate::tracker::classifier::ridge;
use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::Frame;
use crate::tracker::image::plane::Plane;
use crate::tracker::motion::change_test::ChangeTest;
use crate::tracker::motion::global_motion::GlobalMotion;
use crate::tracker::motion::particles::Particle;
use crate::tracker::scale::pyramid;

/// The scratch memory of one frame, room by room.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    /// The profiles of the present frame.
    pub global_motion: GlobalMotion,
    /// The frame in larger pixels, and rotated.
    pub downsampled: Frame,
    pub rectified: Frame,
    pub extractor: Extractor,
    pub dense_search: DenseSearch,
    pub foreground: ForegroundMap,
    pub change_test: ChangeTest,
    /// Running sums of weights, for resampling.
    pub sums: Vec<f64>,
    /// For each particle the logarithm of its prior.
    pub log_priors: Vec<f64>,
    /// Particles where they are in the original view.
    pub original: Vec<Particle>,
    pub candidates: Candidates,
    pub learning: Learning,
    pub rotated: Rotated,
}

/// What is learned from a frame, before it goes into the models.
#[derive(Debug, Default)]
pub(crate) struct Learning {
    pub areas: Vec<Particle>,
    /// Feature vectors, the answer's first.
    pub features: Vec<f32>,
    pub background: background::Scratch,
    pub bag: span::Scratch,
    pub color: color_histogram::Scratch,
    pub fit: ridge::Scratch,
    pub pyramid: pyramid::Scratch,
}

/// The answer in images that are rotated further.
#[derive(Debug, Default)]
pub(crate) struct Rotated {
    pub extractor: Extractor,
    pub frame: Frame,
}

impl Workspace {
    /// Reserves the memory of a rectified view of `frame`, so that the first rotation does not allocate.
    pub fn reserve_rectified(&mut self, frame: &Frame) {
        let scratch = std::mem::take(&mut self.rectified);
        self.rectified = frame.map_planes(scratch, |plane, mut pixels| {
            pixels.resize(plane.pixels.len(), 0);
            Plane::new(plane.size(), pixels, plane.pixel_side)
        });
    }

    /// Takes back the memory of views.
    pub fn give_back(&mut self, view: Cow<'_, Frame>, rectified: Option<Frame>) {
        if let Cow::Owned(downsampled) = view {
            self.downsampled = downsampled;
        }
        if let Some(rectified) = rectified {
            self.rectified = rectified;
        }
    }
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

/// Runs `work` with this thread's workspace.
pub(crate) fn with<T>(work: impl FnOnce(&mut Workspace) -> T) -> T {
    WORKSPACE.with_borrow_mut(work)
}
