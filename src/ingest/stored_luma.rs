//! A decoded picture on its way to the working image, and the room that decoding takes.

use super::orientation;
use crate::tracker::{FrameError, GrayFrame};
use image::metadata::Orientation;
use std::borrow::Cow;

/// Bytes of room that a thread keeps from one frame to the next: enough for the luma of a frame of 4096 x 4096.
const KEPT_BYTES: usize = 16 << 20;

/// Buffers that a thread fills anew for each frame.
#[derive(Default)]
pub(super) struct Room {
    /// The file as the decoder gets it.
    pub(super) file: Vec<u8>,
    /// Decoded values; what is behind those of this frame is of another.
    pub(super) pixels: Vec<u8>,
    /// Memory for a working image; empty while a frame has it.
    pub(super) working: Vec<u8>,
}

impl Room {
    /// Gives back what an unusually large frame took.
    pub(super) fn trim(&mut self) {
        for buffer in [&mut self.file, &mut self.pixels] {
            if buffer.capacity() > KEPT_BYTES {
                *buffer = Vec::new();
            }
        }
    }
}

/// Luma as stored in the file, before it is turned upright.
pub(super) struct Picture<'a> {
    /// The values, row by row.
    pub(super) luma: Cow<'a, [u8]>,
    /// Width and height of `luma`.
    pub(super) size: (u32, u32),
    /// Width and height of the file's picture: more than `size` where the decoder has reduced it.
    pub(super) source: (u32, u32),
    /// How it is to be turned.
    pub(super) orientation: Orientation,
}

impl Picture<'_> {
    /// Turned upright, and down to the working size, into the memory of `working`.
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
            if orientation::swaps_sides(orientation) {
                source = (source.1, source.0);
            }
        }
        GrayFrame::from_reduced(source, size, &luma, working)
    }
}
