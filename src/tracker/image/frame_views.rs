//! The images in which the target of one frame is searched.
//!
//! The first is the frame itself, or the frame in larger pixels ([`downsampled`]) where the target is large. The
//! *rectified* one is that image rotated so that a rotated target is upright ([`Rotation`]).

use crate::tracker::image::downsample::downsampled;
use crate::tracker::image::frame::Frame;
use crate::tracker::image::plane::Plane;
use crate::tracker::image::rect::Rect;
use crate::tracker::image::warp::Rotation;

/// Memory for the pixels of views. [`FrameViews::give_back`] returns it; otherwise the next frame allocates again.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    downsampled: Frame,
    rectified: Frame,
}

impl Scratch {
    /// Reserves the memory of a rectified view of `frame`, so that the first rotation does not allocate.
    pub fn reserve_rectified(&mut self, frame: &Frame) {
        let scratch = std::mem::take(&mut self.rectified);
        self.rectified = frame.map_planes(scratch, |plane, mut pixels| {
            pixels.resize(plane.pixels.len(), 0);
            Plane::new(plane.size(), pixels, plane.pixel_side)
        });
    }
}

/// The views of one frame.
#[derive(Debug)]
pub(crate) struct FrameViews<'a> {
    frame: &'a Frame,
    downsampled: Option<Frame>,
    rectified: Option<Frame>,
}

impl<'a> FrameViews<'a> {
    /// The views of `frame` in pixels that are `factor` = 1, 2 or 4 times as large, not rotated.
    pub fn new(frame: &'a Frame, factor: usize, scratch: &mut Scratch) -> Self {
        let scratch = &mut scratch.downsampled;
        Self {
            frame,
            downsampled: (factor > 1).then(|| downsampled(frame, factor, std::mem::take(scratch))),
            rectified: None,
        }
    }

    /// Rotates what is in `window`, in working pixels.
    pub fn rectify(&mut self, rotation: &Rotation, window: &Rect, scratch: &mut Scratch) {
        let scratch = std::mem::take(&mut scratch.rectified);
        self.rectified = Some(rotation.apply(self.original(), window, scratch));
    }

    /// The view with the target as it is in the frame.
    pub fn original(&self) -> &Frame {
        self.downsampled.as_ref().unwrap_or(self.frame)
    }

    /// The view with the target upright, as in the first frame.
    pub fn rectified(&self) -> &Frame {
        self.rectified.as_ref().unwrap_or_else(|| self.original())
    }

    /// Returns the memory to `scratch`.
    pub fn give_back(self, scratch: &mut Scratch) {
        if let Some(downsampled) = self.downsampled {
            scratch.downsampled = downsampled;
        }
        if let Some(rectified) = self.rectified {
            scratch.rectified = rectified;
        }
    }
}
