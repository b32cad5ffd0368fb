//! An image as a file stores it, and the frame that it becomes, in memory that a thread keeps from one frame to the
//! next.
//!
//! Phones store the rows of the sensor, and a note how the image is to be turned: the EXIF orientation.

use bagtrack_tracker::{Frame, FrameError, FrameFormat, area_average, ycbcr};
use image::metadata::Orientation;
use image::{DynamicImage, GrayImage};
use std::borrow::Cow;

/// Most bytes of a buffer that a thread keeps: enough for the luma of a frame of 4096 x 4096.
const MAX_KEPT_BYTES: usize = 16 << 20;

/// The memory of a frame's luma, Cb and Cr.
pub(super) type Planes = [Vec<u8>; 3];

/// Buffers that a thread fills again for each frame.
#[derive(Default)]
pub(super) struct Scratch {
    /// The file as the decoder gets it.
    pub(super) file: Vec<u8>,
    /// Decoded values. Those behind this frame's are left from an earlier frame.
    pub(super) pixels: Vec<u8>,
    /// Decoded components, likewise.
    pub(super) components: Vec<Vec<u8>>,
    /// Memory for the planes of a frame; empty while a frame has it.
    pub(super) planes: Planes,
}

impl Scratch {
    /// Frees the buffers that an unusually large frame has enlarged.
    pub(super) fn trim(&mut self) {
        let components = self.components.iter_mut();
        for buffer in components.chain([&mut self.file, &mut self.pixels]) {
            if buffer.capacity() > MAX_KEPT_BYTES {
                *buffer = Vec::new();
            }
        }
    }
}

/// Values of one channel, row by row.
pub(super) struct Channel<'a> {
    pub(super) values: Cow<'a, [u8]>,
    /// Width and height.
    pub(super) size: (u32, u32),
}

/// Luma and chroma as stored in the file, before they are turned upright.
pub(super) struct StoredImage<'a> {
    pub(super) luma: Channel<'a>,
    /// Cb and Cr, mostly smaller than the luma.
    pub(super) chroma: Option<[Channel<'a>; 2]>,
    /// Width and height of the image in the file: larger than the luma where the decoder has reduced it.
    pub(super) source: (u32, u32),
    /// How the image is to be turned and mirrored to be upright.
    pub(super) orientation: Orientation,
}

impl StoredImage<'_> {
    /// Turns the image upright and reduces it to `format`, in the memory of the given planes.
    pub(super) fn into_frame(
        self,
        format: FrameFormat,
        [luma, cb, cr]: Planes,
    ) -> Result<Frame, FrameError> {
        let source = upright_size(self.source, self.orientation);
        let upright = |channel: Channel<'_>, size, memory| {
            channel.upright(self.orientation).resized(size, memory)
        };
        let of_luma = upright_size(self.luma.size, self.orientation);
        // Frames that are smaller than the session's are decoded too, and the session refuses them.
        let size = (format.size.0.min(of_luma.0), format.size.1.min(of_luma.1));
        let half = ycbcr::chroma_size(size);
        let luma = upright(self.luma, size, luma);
        let chroma = self
            .chroma
            .map(|[of_cb, of_cr]| [upright(of_cb, half, cb), upright(of_cr, half, cr)]);
        Frame::from_reduced(source, size, luma, chroma)
    }
}

impl Channel<'_> {
    fn upright(mut self, orientation: Orientation) -> Self {
        if orientation != Orientation::NoTransforms {
            let values = self.values.into_owned();
            self.values = Cow::Owned(turned_upright(values, &mut self.size, orientation));
        }
        self
    }

    /// The channel in `size`, in the given memory: the area average, and along a side that has to become longer
    /// repeated values.
    fn resized(self, size: (u32, u32), mut memory: Vec<u8>) -> Vec<u8> {
        memory.clear();
        if self.size == size {
            memory.extend_from_slice(&self.values);
            return memory;
        }
        let longer = (self.size.0.max(size.0), self.size.1.max(size.1));
        if longer == self.size {
            area_average(&self.values, self.size, size, &mut memory);
            return memory;
        }
        let at = |index: u32, from: u32, to: u32| {
            (u64::from(index) * u64::from(from) / u64::from(to)) as usize
        };
        let mut repeated = Vec::with_capacity(longer.0 as usize * longer.1 as usize);
        for y in 0..longer.1 {
            let width = self.size.0 as usize;
            let row = &self.values[at(y, self.size.1, longer.1) * width..][..width];
            repeated.extend((0..longer.0).map(|x| row[at(x, self.size.0, longer.0)]));
        }
        area_average(&repeated, longer, size, &mut memory);
        memory
    }
}

/// The orientation that an EXIF block (from its TIFF header on) notes; no turning where the block has no readable note.
pub(super) fn orientation_of(exif: Option<&[u8]>) -> Orientation {
    exif.and_then(Orientation::from_exif_chunk)
        .unwrap_or(Orientation::NoTransforms)
}

/// Whether width and height change places.
fn swaps_sides(orientation: Orientation) -> bool {
    matches!(
        orientation,
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    )
}

/// Width and height once the image is turned.
pub(super) fn upright_size((width, height): (u32, u32), orientation: Orientation) -> (u32, u32) {
    match swaps_sides(orientation) {
        true => (height, width),
        false => (width, height),
    }
}

/// Turns and mirrors the image of this `size` upright. `size` becomes that of the upright image.
fn turned_upright(luma: Vec<u8>, size: &mut (u32, u32), orientation: Orientation) -> Vec<u8> {
    let stored = GrayImage::from_raw(size.0, size.1, luma).expect("a decoder gives every pixel");
    let mut image = DynamicImage::ImageLuma8(stored);
    image.apply_orientation(orientation);
    *size = (image.width(), image.height());
    image.into_luma8().into_raw()
}
