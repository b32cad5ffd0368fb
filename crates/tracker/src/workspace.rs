//! What is computed anew for each frame: a few megabytes that mean nothing from one frame to the next. Sessions are
//! many and threads few, so each thread has one workspace and sessions have none. A step that finds its thread's
//! workspace warm allocates nothing.

use std::cell::RefCell;

use crate::appearance::foreground_map::ForegroundMap;
use crate::appearance::{color_histogram, model};
use crate::candidates::{Candidates, RotatedView};
use crate::classifier::dense_search::DenseSearch;
use crate::classifier::ridge;
use crate::features::extractor::Extractor;
use crate::image::frame::Frame;
use crate::motion::change_test::ChangeTest;
use crate::motion::global_motion::GlobalMotion;
use crate::motion::orientation;
use crate::motion::particles::Particle;
use crate::scale::pyramid;

/// The memory of one frame.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    /// The views of the frame.
    pub views: ViewBuffers,
    /// What is computed from the views.
    pub scratch: Scratch,
}

/// The memory of the views that are not the frame itself.
#[derive(Debug, Default)]
pub(crate) struct ViewBuffers {
    pub downsampled: Frame,
    pub rectified: Frame,
}

/// What is computed of a frame, module by module.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// The profiles of the present frame.
    pub global_motion: GlobalMotion,
    pub extractor: Extractor,
    pub dense_search: DenseSearch,
    pub foreground: ForegroundMap,
    pub change_test: ChangeTest,
    /// Running sums of weights, for resampling.
    pub sums: Vec<f64>,
    /// For each particle the logarithm of its prior.
    pub log_priors: Vec<f64>,
    /// The new particles at their places in the frame, not in its rotated view.
    pub in_frame: Vec<Particle>,
    pub candidates: Candidates,
    pub learning: Learning,
    /// The frame rotated for other angles of the target.
    pub rotated: [RotatedView; orientation::HYPOTHESES],
}

/// What is learned from a frame, before it goes into the models.
#[derive(Debug, Default)]
pub(crate) struct Learning {
    pub areas: Vec<Particle>,
    /// Feature vectors, the answer's first.
    pub features: Vec<f32>,
    pub appearance: model::Scratch,
    pub color: color_histogram::Scratch,
    pub fit: ridge::Scratch,
    pub pyramid: pyramid::Scratch,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

/// Runs `work` with this thread's workspace.
pub(crate) fn with<T>(work: impl FnOnce(&mut Workspace) -> T) -> T {
    WORKSPACE.with_borrow_mut(work)
}
