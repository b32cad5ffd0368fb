//! Luma as a file stores it, and the frame that it becomes.

use super::orientation;
use crate::tracker::{FrameError, GrayFrame};
use image::metadata::Orientation;
use std::borrow::Cow;

/// Luma as stored in the file, before it is turned upright.
pub(super) struct StoredLuma<'a> {
    /// The values, row by row.
    pub(super) luma: Cow<'a, [u8]>,
    /// Width and height of `luma`.
    pub(super) size: (u32, u32),
    /// Width and height of the image in the file: larger than `size` where the decoder has reduced it.
    pub(super) source: (u32, u32),
    /// How it is to be turned.
    pub(super) orientation: Orientation,
}

impl StoredLuma<'_> {
    /// Turns it upright and reduces it to the working size, in the memory of `working`.
    pub(super) fn into_frame(self, working: Vec<u8>) -> Result<GrayFrame, FrameError> {
        let Self {
            mut luma,
            mut size,
            mut source,
            orientation,
        } = self;
        if orientation != Orientation::NoTransforms {
            luma = Cow::Owned(orientation::apply(
                luma.into_owned(),
                &mut size,
                orientation,
            ));
            source = orientation::upright(source, orientation);
        }
        GrayFrame::from_reduced(source, size, &luma, working)
    }
}
