//! The tracker: section III of *Bags of Affine Subspaces for Robust Object Tracking* (Shirazi, Sanderson, McCool,
//! Harandi), as a pure state machine. No async, no HTTP, no files, no clock.
//!
//! [`Tracker::new`] takes the first frame and a box; [`Tracker::step`] takes the next frame and answers where the box
//! is now. `step` reads in the order of the paper's four components, each of which is a room:
//!
//! - **(A)** *Particles* (`motion`): N hypotheses of centre and scale (section III-A).
//! - **(B)** *Affine subspaces* (`features`, `appearance`): a candidate area becomes a vector v of length D. With the
//!   patches tracked in the P previous frames it makes the matrix V (equation 2); the mean of its columns and its n
//!   dominant left singular vectors are the candidate's affine subspace (equation 1). V is not centred.
//! - **(C)** *The bag* (`appearance`): up to K affine subspaces that were tracked before, a new one every W frames.
//! - **(D)** *Distance* (`grassmann`): α times the squared distance of origins plus 1 - α times the squared Grassmann
//!   geodesic distance of bases, both brought to \[0, 1\] (equations 4 to 8). *Likelihood* (`weights`): exp(-dist / σ),
//!   normalised over the candidates for each entry of the bag, summed over the bag; the greatest sum is the answer,
//!   and the sums are the weights for the next frame (equations 9 to 12).
//!
//! The preset `robust` extends them: a classifier of the target against its surroundings (`classifier`), a filter for
//! the scale (`scale`), a score and an update gate (`confidence`). The other rooms are `image` (frames and boxes),
//! `params` and `linalg`.
//!
//! What the paper leaves open:
//! - Everything happens in the working image ([`Frame`]), as large as the target asks for ([`Params::frame_format`]);
//!   boxes come in and go out in the pixels of the uploaded frame.
//! - Until there are P previous patches V has those there are, and no basis has more columns than V has directions.
//! - Of two bases with different numbers of columns, the smaller number counts.
//! - The draws of a frame depend on the seed and the frame's number alone, so a session that is replayed gives the same
//!   boxes bit for bit on the same machine.
//!
//! ```
//! use bagtrack_tracker::{Frame, Preset, Rect, Tracker};
//!
//! let still = |shift: usize| {
//!     let luma = (0..64 * 48).map(|i| ((i % 64 + shift) * 7 % 250) as u8).collect();
//!     Frame::from_luma(64, 48, luma)
//! };
//! let mut tracker = Tracker::new(&still(0)?, Rect::new(10.0, 10.0, 20.0, 16.0), Preset::Paper.params())?;
//! let answer = tracker.step(&still(1)?)?;
//! println!("frame {}: {:?}, {:.2}", answer.frame, answer.target, answer.score);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod appearance;
mod bag_view;
mod candidates;
mod classifier;
mod confidence;
mod error;
mod estimate;
mod features;
mod grassmann;
mod hypotheses;
mod image;
mod input;
mod learn;
mod linalg;
mod motion;
mod observe;
mod params;
mod scale;
mod seen;
mod snapshot;
mod start;
mod state;
mod step;
mod tracker;
mod weights;
mod workspace;

pub use appearance::subspace::{AffineSubspace, RANK_TOLERANCE};
pub use bag_view::{BagEntry, VectorView};
pub use confidence::score::{Evidence, PREDICTORS, ScoreModel};
pub use error::TrackerError;
pub use estimate::{Estimate, Status};
pub use features::gray::patch;
pub use grassmann::evaluation::Evaluation;
pub use image::frame::{Frame, FrameError, FrameFormat};
pub use image::rect::Rect;
pub use image::resolution::{MAX_WORKING_SIDE, MIN_WORKING_SIDE};
pub use image::area_average::area_average;
pub use image::ycbcr;
pub use input::MIN_BOX_SIDE;
pub use params::presets::Preset;
pub use params::table::{Features, Parameter, Params, ParamsError, Search};
pub use seen::Seen;
pub use tracker::Tracker;
pub use weights::{Likelihoods, arg_max, weigh};
