//! The images that the tracker works on.
//!
//! In: luma values of an uploaded frame, 8 bits a pixel, row by row. Out: 8-bit images of at most
//! [`WORKING_SIDE`](frame::WORKING_SIDE) = 320 pixels on the longer side. Coordinates are floating-point *working
//! pixels* from the top-left corner; pixel (0, 0) covers the square from (0, 0) to (1, 1).
//!
//! | file | holds |
//! |---|---|
//! | [`frame`] | [`GrayFrame`](frame::GrayFrame), the working image of one uploaded frame |
//! | [`rect`] | [`Rect`](rect::Rect), an axis-parallel box |
//! | [`area_average`] | exact downscaling of an uploaded frame to its working size |
//! | [`downsample`] | a working image in pixels 2 or 4 times as large |
//! | [`warp`] | a working image rotated about a point |
//! | [`bilinear`] | rows of interpolated pixels along a line, for `warp` |
//! | [`frame_views`] | the images in which the target of one frame is searched |
//!
//! Errors: only [`GrayFrame`](frame::GrayFrame) checks its input ([`FrameError`](frame::FrameError): no pixels, or not
//! width x height of them). All else takes frames that exist, so a frame has at least one pixel everywhere. Boxes may
//! reach over the edge; what is beyond it is said in each file.
//!
//! Nothing here knows what is tracked or how: no features, no particles, no state.

pub(crate) mod area_average;
pub(crate) mod bilinear;
pub(crate) mod downsample;
pub(crate) mod frame;
pub(crate) mod frame_views;
pub(crate) mod rect;
pub(crate) mod warp;
