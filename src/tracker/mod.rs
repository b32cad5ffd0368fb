//! The tracker: section III of *Bags of Affine Subspaces for Robust Object Tracking* (Shirazi, Sanderson, McCool,
//! Harandi), as a pure state machine. No async, no HTTP, no files, no clock.
//!
//! [`Tracker::new`] takes the first frame and a box; [`Tracker::step`] takes the next frame and answers where the box
//! is now. In between stands what the paper calls its four components:
//!
//! - **(A)** *Particles* (`motion`): N hypotheses of centre and scale. Each frame draws N from the last ones by
//!   their weights and moves each by a Gaussian step.
//! - **(B)** *Affine subspaces* (`patch`, `subspace`): a candidate area becomes a vector v of D gray values
//!   (`patch` is the only file that knows how). With the patches tracked in the P previous frames it makes the matrix
//!   V (equation 2); the mean of its columns and its n dominant left singular vectors are the candidate's affine
//!   subspace (equation 1). V is not centred.
//! - **(C)** *The bag* (`bag`): up to K affine subspaces that were tracked before, a new one every W frames.
//! - **(D)** *Distance* (`grassmann`): α times the squared distance of origins plus 1 - α times the squared Grassmann
//!   geodesic distance of bases, both brought to \[0, 1\] (equations 4 to 8). *Likelihood* (`likelihood`): exp(-dist / σ),
//!   normalised over the candidates for each entry of the bag, summed over the bag; the greatest sum is the answer,
//!   and the sums are the weights for the next frame (equations 9 to 12).
//!
//! How (B) and (D) are computed from inner products alone, without decomposing V for any candidate, is told in
//! `grassmann`. [`Evaluation`] is that computation by itself.
//!
//! What the paper leaves open:
//! - Everything happens in the working image ([`GrayFrame`]), at most [`WORKING_SIDE`] pixels on its longer side; boxes
//!   come in and go out in the pixels of the uploaded frame.
//! - Until there are P previous patches V has those there are, and no basis has more columns than V has directions.
//! - Of two bases with different numbers of columns, the smaller number counts.
//! - The draws of a frame depend on the seed and the frame's number alone, so a session that is replayed gives the same
//!   boxes bit for bit on the same machine.
//!
//! ```
//! use bagtrack::tracker::{GrayFrame, Preset, Rect, Tracker};
//!
//! let still = |shift: usize| {
//!     let luma = (0..64 * 48).map(|i| ((i % 64 + shift) * 7 % 250) as u8).collect();
//!     GrayFrame::from_luma(64, 48, luma)
//! };
//! let mut tracker = Tracker::new(&still(0)?, Rect::new(10.0, 10.0, 20.0, 16.0), Preset::Paper.params())?;
//! let answer = tracker.step(&still(1)?)?;
//! println!("frame {}: {:?}, {:.2}", answer.frame, answer.target, answer.score);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod angle;
mod area;
mod arrival;
mod background;
mod bag;
mod camera;
mod cells;
mod centering;
mod coarse;
mod combination;
mod comparison;
mod directions;
mod discriminant;
mod downscale;
mod eigen;
mod energies;
mod examples;
mod exponential;
mod find;
mod frame;
mod gradients;
mod grassmann;
mod kernel;
mod learning;
mod likelihood;
mod look;
mod matrix;
mod metric;
mod motion;
mod pair_sums;
mod params;
mod patch;
mod pictures;
mod places;
mod planes;
mod poses;
mod presets;
mod pyramid;
mod ranges;
mod rect;
mod rotation;
mod scale;
mod scan;
mod score;
mod search;
mod snapshot;
mod solitary;
mod state;
mod subspace;
mod sums;
mod thumbnail;
mod trust;
mod turn;
mod view;
mod whitening;
mod windows;

pub use frame::{FrameError, GrayFrame, Rect, WORKING_SIDE, working_size};
pub use grassmann::Evaluation;
pub use params::{Features, Params, Search};
pub use patch::patch;
pub use presets::Preset;
pub use ranges::ParamsError;
pub use state::LEAST_BOX_SIDE;
pub use subspace::{AffineSubspace, RANK_TOLERANCE};

use serde::{Deserialize, Serialize};

use state::State;

/// Whether the tracker believes its own box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The box is on the target.
    Tracking,
    /// The box may be on the target.
    Uncertain,
    /// The target is out of sight; the box is the best guess.
    Lost,
}

/// The answer to one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Which frame this answers; the first frame of a session is 0.
    pub frame: u64,
    /// Where the target is, in the pixels of the uploaded frame.
    pub target: Rect,
    /// The chance, in [0, 1], that the box overlaps the target by half or more.
    pub score: f32,
    /// What the score and its history mean.
    pub status: Status,
}

/// Why a tracker could not be made, or a frame could not be taken. The state is unchanged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackerError {
    /// A parameter is out of its range.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// The box is not finite, is too small, or does not touch the frame.
    #[error("the box {0}")]
    Target(&'static str),
    /// The frame's size differs from the size of the session's first frame.
    #[error("the frame is {got_width} x {got_height}, the session's frames are {width} x {height}")]
    FrameSize {
        /// Width of the session's frames, before downscaling.
        width: u32,
        /// Height of the session's frames, before downscaling.
        height: u32,
        /// Width of the frame that came.
        got_width: u32,
        /// Height of the frame that came.
        got_height: u32,
    },
    /// The snapshot is damaged, or of another version.
    #[error("the snapshot {0}")]
    Snapshot(&'static str),
}

/// Follows one object.
///
/// An error of any method leaves the tracker as it was.
#[derive(Debug, Clone)]
pub struct Tracker {
    state: State,
}

impl Tracker {
    /// Starts on `frame` with the box `target`, in the pixels of the uploaded frame. The box may reach over the edge.
    ///
    /// # Errors
    /// A parameter out of its range; a box that is not finite, has a side below [`LEAST_BOX_SIDE`] pixels (or below
    /// one pixel of the working image) or above four times the frame's longer side, or lies outside the frame.
    pub fn new(frame: &GrayFrame, target: Rect, params: Params) -> Result<Self, TrackerError> {
        params.validate()?;
        let source = frame.source_size();
        state::check_target(source, &target)?;
        Ok(comparison::with(|room| {
            let state = State::new(frame, target, params, room);
            Self { state }
        }))
    }

    /// Finds the target in the next frame.
    ///
    /// # Errors
    /// A frame whose uploaded size is not that of the session's first frame.
    pub fn step(&mut self, frame: &GrayFrame) -> Result<Estimate, TrackerError> {
        state::check_frame(self.state.source, frame)?;
        Ok(comparison::with(|room| self.state.find(frame, room)))
    }

    /// The user corrects the box: `frame` counts as the next frame, with the answer given.
    /// The bag keeps what it knew and gains the new look; history and particles restart at the box.
    ///
    /// # Errors
    /// A frame as in [`step`](Self::step), a box as in [`new`](Self::new).
    pub fn retarget(&mut self, frame: &GrayFrame, target: Rect) -> Result<Estimate, TrackerError> {
        state::check_frame(self.state.source, frame)?;
        state::check_target(self.state.source, &target)?;
        comparison::with(|room| self.state.retarget(frame, target, room));
        Ok(self.state.estimate)
    }

    /// The last answer.
    pub fn estimate(&self) -> Estimate {
        self.state.estimate
    }

    /// The particles of the last frame, in the order in which they were drawn: the box of each, in the pixels of the
    /// uploaded frame, and its weight. Weights are at least 0 and sum to 1; the next particles are drawn by them.
    ///
    /// After [`new`](Self::new) and [`retarget`](Self::retarget) all are at the box given, with equal weights. There
    /// are none with [`Search::Answer`]: then the next particles come from the answer, and the last ones are not kept.
    pub fn particles(&self) -> impl ExactSizeIterator<Item = (Rect, f64)> {
        let State {
            particles, weights, ..
        } = &self.state;
        let boxes = particles
            .iter()
            .map(|particle| self.state.target_of(particle));
        boxes.zip(weights.iter().copied())
    }

    /// The parameters of this tracker.
    pub fn params(&self) -> &Params {
        &self.state.params
    }

    /// Width and height of the session's frames, before downscaling.
    pub fn source_size(&self) -> (u32, u32) {
        self.state.source
    }

    /// The whole state as bytes, versioned.
    pub fn snapshot(&self) -> Vec<u8> {
        snapshot::write(&self.state)
    }

    /// A tracker that goes on from `snapshot`, bit for bit.
    ///
    /// # Errors
    /// Bytes that are not a snapshot of this version, are damaged, or hold a state that no tracker can be in.
    pub fn restore(snapshot: &[u8]) -> Result<Self, TrackerError> {
        snapshot::read(snapshot).map(|state| Self { state })
    }
}
