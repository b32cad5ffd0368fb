//! The tracker: section III of *Bags of Affine Subspaces for Robust Object Tracking* (Shirazi, Sanderson, McCool,
//! Harandi), as a pure state machine. No async, no HTTP, no files, no clock.
//!
//! [`Tracker::new`] takes the first frame and a box; [`Tracker::step`] takes the next frame and answers where the box
//! is now. In between stands what the paper calls its four components:
//!
//! - **(A)** *Particles* (`motion`): N hypotheses of centre and scale. Each frame draws N from the last ones by
//!   their weights and moves each by a Gaussian step.
//! - **(B)** *Affine subspaces* (`patch`, `subspace`, `candidate`): a candidate area becomes a vector v of D gray values
//!   (`patch` is the only file that knows how). With the patches tracked in the P previous frames it makes the matrix
//!   V (equation 2); the mean of its columns and its n dominant left singular vectors are the candidate's affine
//!   subspace (equation 1). V is not centred.
//! - **(C)** *The bag* (`bag`): up to K affine subspaces that were tracked before, a new one every W frames.
//! - **(D)** *Distance* (`distance`): α times the squared distance of origins plus 1 - α times the squared Grassmann
//!   geodesic distance of bases, both brought to \[0, 1\] (equations 4 to 8). *Likelihood* (`likelihood`): exp(-dist / σ),
//!   normalised over the candidates for each entry of the bag, summed over the bag; the greatest sum is the answer,
//!   and the sums are the weights for the next frame (equations 9 to 12).
//!
//! How (B) and (D) are computed from inner products alone, without decomposing V for any candidate, is told in
//! `products` and `candidate`. [`Evaluation`] is that computation by itself.
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

mod abreast;
mod angle;
mod area;
mod arrival;
mod background;
mod bag;
mod camera;
mod candidate;
mod cells;
mod centering;
mod coarse;
mod combination;
mod comparison;
mod directions;
mod discriminant;
mod distance;
mod dominant;
mod downscale;
mod eigen;
mod energies;
mod evaluation;
mod examples;
mod exponential;
mod frame;
mod gradients;
mod history;
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
#[cfg(target_arch = "x86_64")]
mod permute;
mod places;
mod planes;
mod poses;
mod posterior;
mod presets;
mod products;
mod pyramid;
mod ranges;
mod rect;
mod rotation;
mod scale;
mod scan;
mod score;
mod search;
mod singular;
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

pub use evaluation::Evaluation;
pub use frame::{FrameError, GrayFrame, Rect, WORKING_SIDE, working_size};
pub use params::{Features, Params, Search};
pub use patch::patch;
pub use presets::Preset;
pub use ranges::ParamsError;
pub use state::LEAST_BOX_SIDE;
pub use subspace::{AffineSubspace, RANK_TOLERANCE};

use serde::{Deserialize, Serialize};

use comparison::Comparison;
use motion::{Draws, Particle};
use score::Evidence;
use search::Sought;
use state::State;
use view::View;

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
        Ok(comparison::with(|room| self.find(frame, room)))
    }

    fn find(&mut self, frame: &GrayFrame, room: &mut Comparison) -> Estimate {
        let state = &mut self.state;
        let number = state.estimate.frame + 1;
        let mut draws = motion::generator(state.params.seed, number, Draws::Particles);
        let widening = state.widening();
        let camera = state.camera.as_mut();
        let shift = camera.map_or((0.0, 0.0), |camera| camera.shift(frame, &mut room.camera));
        let rotation = state.rotation();
        let in_picture =
            |place: Particle| rotation.map_or(place, |rotation| rotation.in_picture(&place));
        let sought = Sought {
            last: state.answer,
            shift: rotation.map_or(shift, |rotation| rotation.turned_shift(shift)),
            widening,
            params: &state.params,
            reach: &state.reach,
        };

        // (A) Where it may be.
        room.begin(state, sought.most());
        room.rotation = rotation;
        let furthest = sought.furthest() + state.learning_radius(number);
        let furthest = furthest.max(sought.scanned());
        let (reach, params) = (&state.reach, &state.params);
        let grain = coarse::grain(&state.answer, reach, params);
        let coarse = (grain > 1)
            .then(|| coarse::picture(frame, grain, std::mem::take(&mut room.coarse_pixels)));
        let picture = coarse.as_ref().unwrap_or(frame);
        let upright = rotation.map(|rotation| {
            let window = View::window(&[state.answer], furthest, reach, params);
            rotation.apply(picture, &window, std::mem::take(&mut room.turned_pixels))
        });
        let seen = upright.as_ref().unwrap_or(picture);
        match params.search {
            Search::Resampled => {
                motion::propose(state, &mut draws, &mut room.sums, &mut room.particles);
                let particles = &room.particles;
                room.view.open(seen, particles, furthest, reach, params);
            }
            Search::Answer => {
                let answer = [state.answer];
                room.view.open(seen, &answer, furthest, reach, params);
                room.scan.look(&mut room.view, &sought, &state.discriminant);
                sought.propose(room.scan.peaks(), &mut draws, &mut room.particles);
                room.scan.sift(&sought, &mut room.particles);
            }
        }

        if params.arrival_weight > 0.0 {
            let carried = in_picture(sought.carried());
            room.arrival.take(frame);
            room.arrival
                .compare(&state.last_seen, &carried, furthest, reach);
        }

        // (B) What is seen there, and (D) how that compares with what is known.
        room.extend(seen, 0, state);
        let mut best = room.weigh(&sought);
        let first = room.particles.len();
        if sought.refined() > 0 {
            sought.refine(&room.weights, &mut draws, &mut room.particles);
            room.extend(seen, first, state);
            best = room.weigh(&sought);
        }
        let evidence = room.evidence(best, &state.trust);
        let lost = state.is_out_of_sight(&evidence);
        let found = if lost {
            state.frames_lost = state.frames_lost.saturating_add(1);
            sought.carried()
        } else {
            let radius = state.params.averaging_radius;
            let found = search::average(&room.particles, &room.weights, best, radius);
            let found = state.measure_scale(seen, found, room);
            state.frames_lost = 0;
            found
        };
        let answer = state.reach.hold(in_picture(found));
        let evidence = Evidence {
            scale: answer.scale,
            ..evidence
        };
        let trusted = !lost && state.trust.judge(evidence.first, number, &state.params);
        let (score, status) = state.usual.judge(&evidence, lost, trusted);

        // (C) What is to be remembered of it.
        state.answer = answer;
        state.keep_particles(&room.particles, &room.weights);
        if lost {
            // What is found again is looked for as it was first.
            state.turn = 0.0;
        } else {
            state.see(&room.arrival);
        }
        if trusted && state.believes(score, number) {
            let turn = state.measure_turn(picture, &evidence, room);
            state.answer = found;
            state.learn(seen, number, room);
            (state.answer, state.turn) = (answer, turn);
        }
        if let Some(upright) = upright {
            room.turned_pixels = upright.into_pixels();
        }
        if let Some(coarse) = coarse {
            room.coarse_pixels = coarse.into_pixels();
        }
        state.estimate = Estimate {
            frame: number,
            target: state.target_of(&answer),
            score,
            status,
        };
        state.estimate
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
