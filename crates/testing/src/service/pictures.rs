//! Frames drawn here: a textured target that moves over a textured ground.

use image::{DynamicImage, GrayImage, ImageFormat, Luma};
use std::io::Cursor;

pub const WIDTH: u32 = 96;
pub const HEIGHT: u32 = 72;

/// The scene at frame `t`: the target is 16 x 12 pixels, at (20, 15) in frame 0, and moves by (2, 1) a frame.
pub fn scene(t: u32) -> GrayImage {
    let (left, top) = (20 + 2 * t, 15 + t);
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let (dx, dy) = (x.wrapping_sub(left), y.wrapping_sub(top));
        Luma([if dx < 16 && dy < 12 {
            150 + ((dx * 5) ^ (dy * 9)) as u8 % 100
        } else {
            40 + ((x * 3) ^ (y * 7)) as u8 % 60
        }])
    })
}

pub fn encode(picture: GrayImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = match format {
        ImageFormat::WebP => DynamicImage::ImageRgb8(DynamicImage::ImageLuma8(picture).to_rgb8()),
        _ => DynamicImage::ImageLuma8(picture),
    };
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

pub fn png(t: u32) -> Vec<u8> {
    encode(scene(t), ImageFormat::Png)
}

/// A picture of another size than the scene's.
pub fn png_of(width: u32, height: u32) -> Vec<u8> {
    let picture = GrayImage::from_fn(width, height, |x, y| Luma([(x * 3 + y * 5) as u8]));
    encode(picture, ImageFormat::Png)
}
