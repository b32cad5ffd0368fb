//! Synthetic clips with exact ground truth: a textured card moves in front of a textured wall.
//!
//! In: [`Settings`], which are the [`Scene`], the number and size of the frames, a seed, and [`Attributes`] that make
//! the clip hard: a small, fast, blurred, growing or turning card, a shaken camera, cards that look alike. In the
//! default scene the card moves in smooth turns, comes nearer, passes through a dim spell and is half covered for a
//! while. In the other scenes it goes out of sight and comes back. Patches with a pattern like the card's hang on the
//! wall, and every pixel has sensor noise.
//!
//! Out: a [`Clip`], which draws each frame and tells where the card is and how much of it is visible. It can be written
//! as a folder in the OTB layout, as JPEG or PNG ([`Format`]). The same settings draw the same clip, bit for bit, on
//! one machine.
//!
//! What can go wrong ([`SampleError`]): too few frames for the scene, a side (in a smaller frame the card would have
//! too few pixels) or an attribute out of its range, or a folder that cannot be written.
//!
//! ```
//! use bagtrack_sample::{Clip, Settings};
//! let clip = Clip::new(Settings { frames: 3, ..Settings::default() })?;
//! let picture = clip.draw(1);
//! let card = clip.target(1);
//! assert_eq!(picture.dimensions(), (320, 240));
//! assert!(card.x > 0.0 && card.x + card.width < 320.0);
//! # Ok::<(), bagtrack_sample::SampleError>(())
//! ```

mod attributes;
mod clip;
mod draw;
mod error;
mod folder;
mod format;
mod pose;
mod scene;
mod settings;
mod smoothstep;
mod texture;
mod timeline;

pub use attributes::Attributes;
pub use clip::Clip;
pub use error::SampleError;
pub use format::Format;
pub use scene::Scene;
pub use settings::{MAX_SIDE, MIN_SIDE, Settings};
