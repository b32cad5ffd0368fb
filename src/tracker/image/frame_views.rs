//! (A) The pictures in which the target of a frame is looked for.
//!
//! That is the frame itself, unless another one serves better: one in larger pixels where the target is large
//! ([`coarse`]), and one that is turned with the target where that is turned ([`Rotation`]). Both are made in memory of
//! the thread, which has to be given back, or the next frame asks for memory again.

use crate::tracker::image::downsample;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;
use crate::tracker::image::warp::Rotation;
use crate::tracker::motion::particles::StateBounds;
use crate::tracker::state::State;

/// Memory for the pixels of pictures, whatever it holds.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    coarse: Vec<u8>,
    rectified: Vec<u8>,
}

impl Scratch {
    /// Makes room for a turned picture of a frame of `bounds`, so that the first turn finds it.
    pub fn begin(&mut self, bounds: &StateBounds) {
        let pixels = bounds.frame_width * bounds.frame_height;
        self.rectified.reserve(pixels as usize);
    }
}

/// The pictures of one frame.
#[derive(Debug)]
pub(crate) struct FrameViews<'a> {
    frame: &'a GrayFrame,
    coarse: Option<GrayFrame>,
    rectified: Option<GrayFrame>,
}

impl<'a> FrameViews<'a> {
    /// The pictures of `frame` for a target about as large as the last answer of `state`, not turned yet.
    pub fn of(frame: &'a GrayFrame, state: &State, scratch: &mut Scratch) -> Self {
        let downsample = downsample::downsample(&state.answer, &state.bounds, &state.params);
        let coarse = (downsample > 1)
            .then(|| downsample::picture(frame, downsample, std::mem::take(&mut scratch.coarse)));
        Self {
            frame,
            coarse,
            rectified: None,
        }
    }

    /// Turns what is in `window`, in working pixels, by `rotation`.
    pub fn orientation(&mut self, rotation: &Rotation, window: &Rect, scratch: &mut Scratch) {
        let pixels = std::mem::take(&mut scratch.rectified);
        self.rectified = Some(rotation.apply(self.original(), window, pixels));
    }

    /// The target as it is in the frame.
    pub fn original(&self) -> &GrayFrame {
        self.coarse.as_ref().unwrap_or(self.frame)
    }

    /// The target as it was first, upright.
    pub fn rectified(&self) -> &GrayFrame {
        self.rectified.as_ref().unwrap_or_else(|| self.original())
    }

    /// Gives the memory back.
    pub fn give_back(self, scratch: &mut Scratch) {
        if let Some(coarse) = self.coarse {
            scratch.coarse = coarse.into_pixels();
        }
        if let Some(rectified) = self.rectified {
            scratch.rectified = rectified.into_pixels();
        }
    }
}
