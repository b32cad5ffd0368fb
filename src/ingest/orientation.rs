//! The EXIF orientation: phones store the sensor's rows and note how the picture is to be turned.

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage};

/// The orientation that an EXIF block (from its TIFF header on) notes; upright where it says nothing readable.
pub(super) fn of_exif(exif: Option<&[u8]>) -> Orientation {
    exif.and_then(Orientation::from_exif_chunk)
        .unwrap_or(Orientation::NoTransforms)
}

/// Turns and mirrors the picture upright.
pub(super) fn apply(luma: GrayImage, orientation: Orientation) -> GrayImage {
    if orientation == Orientation::NoTransforms {
        return luma;
    }
    let mut image = DynamicImage::ImageLuma8(luma);
    image.apply_orientation(orientation);
    image.into_luma8()
}
