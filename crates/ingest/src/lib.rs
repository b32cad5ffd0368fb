//! Uploaded bytes to a frame.
//!
//! In: the bytes of one image file, and [`Limits`]. Out: a [`Frame`](bagtrack_tracker::Frame), or an
//! [`IngestError`].
//!
//! - *Type*: by the bytes alone (JPEG, PNG, WebP), never by a name or a header of the request.
//! - *Whole*: a file that ends before its own end marker is an error, even where a decoder would guess the rest.
//! - *Chroma*: where the file has colour and the session wants it, in half of the luma's width and height.
//! - *Luma*: Rec. 601, `Y = 0.299 R + 0.587 G + 0.114 B`, rounded. For JPEG this is its own Y channel. Colour profiles
//!   and gamma are not applied. 16 bits are rounded to 8. Transparency is blended over black, as a canvas does when it
//!   writes a JPEG.
//! - *Upright*: the EXIF orientation of a JPEG, PNG or WebP is applied, so boxes are in the pixels that a browser
//!   shows.
//! - *Animations*: the first image.
//!
//! What can go wrong: the bytes are hostile. They may claim a huge size, be cut short, or cost far more to decode than
//! to send. So the structure of the file is read, and every limit checked, before a pixel is decoded.
//!
//! [`inspect`] does that once; the returned value knows the size, and decodes without reading the structure again.
//!
//! zune-jpeg reads the headers of every JPEG and decides what is damaged. rusty_jpeg decodes files with one scan to
//! their stored components, and reduces large images while it decodes. With the feature `turbo`, libjpeg-turbo is tried
//! first. Both are fast paths: on any error or warning, and for any file that they do not take, zune-jpeg decides.
//!
//! ```
//! use bagtrack_ingest::{decode, IngestError, Limits};
//! let error = decode(b"a letter", &Limits::default()).unwrap_err();
//! assert_eq!(error, IngestError::UnreadFormat("text"));
//! ```

mod decode;
mod error;
mod jpeg;
mod jpeg_markers;
mod limits;
mod luma;
mod png_chunks;
mod prefix_codes;
mod raster;
mod sniff;
mod stored_image;
#[cfg(feature = "turbo")]
mod turbo;
pub mod video;
mod vp8l;
mod webp_chunks;

pub use decode::{Inspected, decode, decode_to, inspect, recycle};
pub use error::IngestError;
pub use limits::Limits;
pub use sniff::{is_text, type_name, unread_type};
