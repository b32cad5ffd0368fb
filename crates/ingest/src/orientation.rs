//! The EXIF orientation: phones store the rows of the sensor, and a note how the image is to be turned.

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage};

/// The orientation that an EXIF block (from its TIFF header on) notes; upright where it says nothing readable.
pub(super) fn of_exif(exif: Option<&[u8]>) -> Orientation {
    exif.and_then(Orientation::from_exif_chunk)
        .unwrap_or(Orientation::NoTransforms)
}

/// Whether width and height change places.
pub(super) fn swaps_sides(orientation: Orientation) -> bool {
    matches!(
        orientation,
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    )
}

/// Width and height once the image is turned.
pub(super) fn upright((width, height): (u32, u32), orientation: Orientation) -> (u32, u32) {
    match swaps_sides(orientation) {
        true => (height, width),
        false => (width, height),
    }
}

/// Turns and mirrors the image of this `size` upright. `size` becomes that of the upright image.
pub(super) fn apply(luma: Vec<u8>, size: &mut (u32, u32), orientation: Orientation) -> Vec<u8> {
    let stored = GrayImage::from_raw(size.0, size.1, luma).expect("a decoder gives every pixel");
    let mut image = DynamicImage::ImageLuma8(stored);
    image.apply_orientation(orientation);
    *size = (image.width(), image.height());
    image.into_luma8().into_raw()
}
