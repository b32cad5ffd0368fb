//! The images that the tracker works on.
//!
//! In: luma and chroma of an uploaded frame, 8 bits a value, row by row. Out: the same in the size in which the session
//! works ([`resolution`]). Coordinates are floating-point *working pixels* from the top-left corner; pixel (0, 0)
//! covers the square from (0, 0) to (1, 1).
//!
//! | file | holds |
//! |---|---|
//! | [`frame`] | [`Frame`](frame::Frame), one uploaded frame: luma and, with colour, chroma |
//! | [`plane`] | one channel of a frame |
//! | [`ycbcr`] | RGB to luma and chroma |
//! | [`resolution`] | the size in which a session works |
//! | [`rect`] | [`Rect`](rect::Rect), an axis-parallel box |
//! | [`area_average`] | exact downscaling of an uploaded frame to its working size |
//! | [`downsample`] | a working image in pixels 2 or 4 times as large |
//! | [`warp`] | a working image rotated about a point |
//!
//! Errors: only [`Frame`](frame::Frame) checks its input ([`FrameError`](frame::FrameError): no pixels, or not width x
//! height of them). All else takes frames that exist, so a frame has at least one pixel everywhere. Boxes may reach
//! over the edge; each file says what is beyond it.
//!
//! Nothing here knows what is tracked or how: no features, no particles, no state.

pub(crate) mod area_average;
pub(crate) mod downsample;
pub(crate) mod frame;
pub(crate) mod plane;
pub(crate) mod rect;
pub(crate) mod resolution;
pub(crate) mod warp;
pub mod ycbcr;
