//! Frames with the box drawn on them.

use bagtrack::tracker::{Estimate, Rect, Status};
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageDecoder, ImageError, ImageReader, Rgb, RgbImage};
use std::io::Cursor;

const JPEG_QUALITY: u8 = 92;

/// The frame as JPEG, upright, with the box: green while tracking, orange while uncertain, red when lost.
/// `bytes` have been decoded before, so their size is within the limits.
pub fn with_box(bytes: &[u8], estimate: &Estimate) -> Result<Vec<u8>, ImageError> {
    let mut decoder = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()?
        .into_decoder()?;
    let orientation = decoder.orientation()?;
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    let mut picture = picture.into_rgb8();
    let color = match estimate.status {
        Status::Tracking => Rgb([40, 220, 60]),
        Status::Uncertain => Rgb([255, 165, 0]),
        Status::Lost => Rgb([230, 30, 30]),
    };
    outline(&mut picture, &estimate.target, color);
    let mut jpeg = Vec::new();
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY))?;
    Ok(jpeg)
}

/// Draws the border of the box inwards, thicker on large frames; what is outside the frame is left out.
fn outline(picture: &mut RgbImage, target: &Rect, color: Rgb<u8>) {
    let thickness = f64::from(1 + picture.width().max(picture.height()) / 320);
    let (left, top) = (target.x.round(), target.y.round());
    let (right, bottom) = (
        (target.x + target.width).round(),
        (target.y + target.height).round(),
    );
    let span = |from: f64, to: f64, limit: u32| {
        let clamp = |edge: f64| edge.clamp(0.0, f64::from(limit)) as u32;
        clamp(from)..clamp(to)
    };
    for y in span(top, bottom, picture.height()) {
        for x in span(left, right, picture.width()) {
            let (across, down) = (f64::from(x), f64::from(y));
            let to_border = (across - left)
                .min(right - 1.0 - across)
                .min(down - top)
                .min(bottom - 1.0 - down);
            if to_border < thickness {
                picture.put_pixel(x, y, color);
            }
        }
    }
}
