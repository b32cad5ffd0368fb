//! bagtrack follows one object through a sequence of frames. The first frame and a box start it; every further
//! frame gets a box back.
//!
//! The tracker implements the paper *Bags of Affine Subspaces for Robust Object Tracking*: a particle filter whose
//! candidates, and whose memory of the object, are affine subspaces, compared on a Grassmann manifold. An HTTP
//! service for clients that upload frames is built on it.
//!
//! # The tracker alone
//!
//! [`tracker`] needs neither the service nor image files: a frame is a width, a height and one byte of luma for each
//! pixel, row by row. Leave the other features out:
//!
//! ```toml
//! bagtrack = { version = "0.1", default-features = false }
//! ```
//!
//! ```
//! use bagtrack::tracker::{FrameError, Frame, Preset, Rect, Tracker};
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
//!
//! # Modules and features
//!
//! | module | feature | holds |
//! |---|---|---|
//! | [`tracker`] | none | the paper, as a pure state machine: no async, no HTTP, no files, no clock |
//! | `ingest` | `ingest` | JPEG, PNG and WebP files to frames, with limits that are checked before decoding |
//! | `sessions` | `service` | the live sessions: look up, expire, admit work, replay |
//! | `http` | `service` | the interface: routes, problem documents, the OpenAPI document |
//! | `eval` | `eval` | annotated sequences and error measures |
//! | `sample` | `eval` | a synthetic clip with exact ground truth |
//!
//! `service` and `eval` bring `ingest` with them. `cli` builds the program `bagtrack` and brings both. `service`, `cli`
//! and `eval` are on by default. `turbo` decodes JPEGs with libjpeg-turbo, which needs a C compiler, cmake and nasm.
//!
//! Data goes one way, `http -> ingest -> sessions -> tracker`, and the answer comes back the same way.

#[cfg(feature = "service")]
pub mod drawing;
#[cfg(feature = "eval")]
pub mod eval;
#[cfg(feature = "service")]
pub mod http;
#[cfg(feature = "ingest")]
pub mod ingest;
#[cfg(feature = "eval")]
pub mod sample;
#[cfg(feature = "service")]
pub mod sessions;
pub mod tracker;
