//! (A) The pictures in which the target of a frame is looked for.
//!
//! That is the frame itself, unless another one serves better: one in larger pixels where the target is large
//! ([`coarse`]), and one that is turned with the target where that is turned ([`Rotation`]). Both are made in memory of
//! the thread, which has to be given back, or the next frame asks for memory again.

use crate::tracker::image::downsample;
use crate::tracker::motion::particles::Reach;
use crate::tracker::image::warp::Rotation;
use crate::tracker::state::State;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;

/// Memory for the pixels of pictures, whatever it holds.
#[derive(Debug, Default)]
pub(crate) struct Room {
    coarse: Vec<u8>,
    upright: Vec<u8>,
}

impl Room {
    /// Makes room for a turned picture of a frame of `reach`, so that the first turn finds it.
    pub fn begin(&mut self, reach: &Reach) {
        let pixels = reach.frame_width * reach.frame_height;
        self.upright.reserve(pixels as usize);
    }
}

/// The pictures of one frame.
#[derive(Debug)]
pub(crate) struct Pictures<'a> {
    frame: &'a GrayFrame,
    coarse: Option<GrayFrame>,
    upright: Option<GrayFrame>,
}

impl<'a> Pictures<'a> {
    /// The pictures of `frame` for a target about as large as the last answer of `state`, not turned yet.
    pub fn of(frame: &'a GrayFrame, state: &State, room: &mut Room) -> Self {
        let grain = downsample::grain(&state.answer, &state.reach, &state.params);
        let coarse =
            (grain > 1).then(|| downsample::picture(frame, grain, std::mem::take(&mut room.coarse)));
        Self {
            frame,
            coarse,
            upright: None,
        }
    }

    /// Turns what is in `window`, in working pixels, by `rotation`.
    pub fn turn(&mut self, rotation: &Rotation, window: &Rect, room: &mut Room) {
        let pixels = std::mem::take(&mut room.upright);
        self.upright = Some(rotation.apply(self.unturned(), window, pixels));
    }

    /// The target as it is in the frame.
    pub fn unturned(&self) -> &GrayFrame {
        self.coarse.as_ref().unwrap_or(self.frame)
    }

    /// The target as it was first, upright.
    pub fn upright(&self) -> &GrayFrame {
        self.upright.as_ref().unwrap_or_else(|| self.unturned())
    }

    /// Gives the memory back.
    pub fn give_back(self, room: &mut Room) {
        if let Some(coarse) = self.coarse {
            room.coarse = coarse.into_pixels();
        }
        if let Some(upright) = self.upright {
            room.upright = upright.into_pixels();
        }
    }
}
