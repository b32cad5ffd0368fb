//! The tracker: section III of *Bags of Affine Subspaces for Robust Object Tracking* (Shirazi, Sanderson, McCool,
//! Harandi), as a pure state machine. No async, no HTTP, no files, no clock.
//!
//! [`Tracker::new`] takes the first frame and a box; [`Tracker::step`] takes the next frame and answers where the box
//! is now. `step` reads in the order of the paper's four components, each in modules of its own:
//!
//! - **(A)** *Particles* (`motion`): N hypotheses of centre and scale (section III-A).
//! - **(B)** *Affine subspaces* (`features`, `grassmann`): a candidate area becomes a vector v of length D. With the
//!   patches tracked in the P previous frames it makes the matrix V (equation 2); the mean of its columns and its n
//!   dominant left singular vectors are the candidate's affine subspace (equation 1). V is not centred.
//! - **(C)** *The bag* (`appearance`): up to K affine subspaces that were tracked before, a new one every W frames.
//! - **(D)** *Distance* (`grassmann`): α times the squared distance of origins plus 1 - α times the squared Grassmann
//!   geodesic distance of bases, both brought to \[0, 1\] (equations 4 to 8). *Likelihood* (`weights`): exp(-dist / σ),
//!   normalised over the candidates for each entry of the bag, summed over the bag; the greatest sum is the answer,
//!   and the sums are the weights for the next frame (equations 9 to 12).
//!
//! The preset `robust` extends them. What is the paper's, and what is ours:
//!
//! | module | paper | ours |
//! |---|---|---|
//! | `motion` | resampling, Brownian motion | search around the answer, global motion, change test, orientation |
//! | `features` | gray patches | gradient histograms with chroma |
//! | `appearance` | the bag, the history | candidates of one vector, the background's metric, colour histograms |
//! | `grassmann` | affine subspaces and their distance | |
//! | `weights`, `step` | likelihoods, the sum rule, the answer | priors, a second round, pinned entries |
//! | `classifier`, `scale`, `confidence` | | a discriminant, a filter for the scale, the score and the update gate |
//!
//! The other modules are `image` (frames and boxes), `params` and `linalg`; [`KeyFrames`] thins a finished track.
//!
//! What the paper leaves open:
//! - Everything happens in the working image ([`Frame`]), as large as the target asks for ([`Params::frame_format`]);
//!   boxes come in and go out in the pixels of the uploaded frame.
//! - While there are fewer than P previous patches, V has only these. No basis has more columns than V has directions.
//! - Of two bases with different numbers of columns, the smaller number counts.
//! - The draws of a frame depend on the seed and the frame's number alone, so a session that is replayed gives the same
//!   boxes bit for bit on the same machine.
//!
//! A frame is a width, a height and one byte of luma for each pixel, row by row:
//!
//! ```
//! use bagtrack_tracker::{FrameError, Frame, Preset, Rect, Tracker};
//!
//! /// Where the target is in frame `t`: it moves by 2 pixels to the right and 1 down in each frame.
//! fn target(t: u32) -> Rect {
//!     Rect::new(40.0 + 2.0 * f64::from(t), 30.0 + f64::from(t), 24.0, 20.0)
//! }
//!
//! /// Draws frame `t`: a bright target with a texture, on a darker ground with another one.
//! fn frame(t: u32) -> Result<Frame, FrameError> {
//!     let (left, top) = (40 + 2 * t, 30 + t);
//!     let mut luma = Vec::new();
//!     for y in 0..120 {
//!         for x in 0..160 {
//!             let is_target = (left..left + 24).contains(&x) && (top..top + 20).contains(&y);
//!             luma.push(match is_target {
//!                 true => 150 + (((x - left) * 5) ^ ((y - top) * 9)) as u8 % 100,
//!                 false => 40 + ((x * 3) ^ (y * 7)) as u8 % 60,
//!             });
//!         }
//!     }
//!     Frame::from_luma(160, 120, luma)
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut tracker = Tracker::new(&frame(0)?, target(0), Preset::Robust.params())?;
//! for t in 1..10 {
//!     let estimate = tracker.step(&frame(t)?)?;
//!     println!("frame {}: {:?}, score {:.2}", estimate.frame, estimate.target, estimate.score);
//! }
//! assert!(tracker.estimate().target.overlap(&target(9)) > 0.7);
//!
//! // A tracker goes on from its snapshot exactly as it would have gone on itself.
//! let mut restored = Tracker::restore(&tracker.snapshot())?;
//! assert_eq!(restored.step(&frame(10)?)?, tracker.step(&frame(10)?)?);
//! # Ok(())
//! # }
//! ```

mod appearance;
mod bag_view;
mod candidates;
mod classifier;
mod confidence;
mod diagnostics;
mod error;
mod estimate;
mod expert;
mod features;
mod grassmann;
mod image;
mod input;
mod key_frames;
mod learn;
mod linalg;
mod lost;
mod motion;
mod params;
mod plausible_box;
mod propose;
mod scale;
mod snapshot;
mod start;
mod state;
mod step;
mod tracker;
mod views;
mod weights;
mod workspace;

pub use bag_view::{BagEntry, VectorView};
pub use confidence::score::{Evidence, PREDICTORS, ScoreModel};
pub use diagnostics::Diagnostics;
pub use error::TrackerError;
pub use estimate::{Estimate, Status};
pub use expert::opinion::{Expert, InDoubt, Sighting};
pub use features::gray::patch;
pub use grassmann::evaluation::Evaluation;
pub use grassmann::subspace::{AffineSubspace, RANK_TOLERANCE};
pub use image::area_average::area_average;
pub use image::frame::{Frame, FrameError, FrameFormat};
pub use image::rect::Rect;
pub use image::resolution::{MAX_WORKING_SIDE, MIN_WORKING_SIDE};
pub use image::ycbcr;
pub use input::MIN_BOX_SIDE;
pub use key_frames::KeyFrames;
pub use params::presets::Preset;
pub use params::table::{Features, Parameter, Params, ParamsError, Search};
pub use plausible_box::{ImplausibleBox, box_warnings, check_box};
pub use snapshot::MAGIC as SNAPSHOT_MAGIC;
pub use tracker::Tracker;
pub use weights::{Likelihoods, arg_max, sum_rule_weights};
