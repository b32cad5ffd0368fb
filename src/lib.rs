//! bagtrack follows one object through a sequence of frames: the first frame and a box start it, every further
//! frame gets a box back.
//!
//! The tracker is the paper *Bags of Affine Subspaces for Robust Object Tracking*: a particle filter whose
//! candidates, and whose memory of the object, are affine subspaces, compared on a Grassmann manifold. Around it is
//! an HTTP service for clients that upload frames. The binary of the same name has both, and tools to measure them.
//!
//! Data goes one way, `http -> ingest -> sessions -> tracker`, and the answer comes back the same way:
//!
//! | module | is |
//! |---|---|
//! | [`http`] | the interface: routes, problem documents, the OpenAPI document |
//! | [`ingest`] | uploaded bytes to a working image, with limits before decoding |
//! | [`sessions`] | the live sessions: look up, expire, admit work |
//! | [`tracker`] | the paper, as a pure state machine: no async, no HTTP, no files, no clock |
//! | [`eval`] | annotated sequences and error measures |
//! | [`sample`] | a synthetic clip with exact ground truth |
//!
//! # Example
//!
//! The tracker by itself, on the clip that the crate draws:
//!
//! ```
//! use bagtrack::ingest::{self, Limits};
//! use bagtrack::sample::{Clip, Settings};
//! use bagtrack::tracker::{Preset, Tracker};
//! use image::ImageFormat;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let clip = Clip::new(Settings::default())?;
//! let upload = |index| -> Result<Vec<u8>, image::ImageError> {
//!     let mut bytes = std::io::Cursor::new(Vec::new());
//!     clip.draw(index).write_to(&mut bytes, ImageFormat::Jpeg)?;
//!     Ok(bytes.into_inner())
//! };
//! let limits = Limits::default();
//! let first = ingest::decode(&upload(0)?, &limits)?;
//! let mut tracker = Tracker::new(&first, clip.target(0), Preset::Paper.params())?;
//! for index in 1..4 {
//!     let estimate = tracker.step(&ingest::decode(&upload(index)?, &limits)?)?;
//!     println!("frame {}: {:?}", estimate.frame, estimate.target);
//! }
//! assert_eq!(tracker.estimate().frame, 3);
//! # Ok(())
//! # }
//! ```

pub mod eval;
pub mod http;
pub mod ingest;
pub mod sample;
pub mod sessions;
pub mod tracker;
