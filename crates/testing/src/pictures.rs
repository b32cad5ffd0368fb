//! Drawn frames: a textured target that moves over a textured background.

use crate::picture_files;
use image::{DynamicImage, GrayImage, ImageFormat, Luma};

pub const WIDTH: u32 = 96;
pub const HEIGHT: u32 = 72;

/// The scene at frame `t`: the target is 16 x 12 pixels, at (20, 15) in frame 0, and moves by (2, 1) a frame.
pub fn scene(t: u32) -> GrayImage {
    scene_at(20 + 2 * t, 15 + t)
}

/// The scene with the upper left corner of the target at this pixel.
pub fn scene_at(left: u32, top: u32) -> GrayImage {
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
    let picture = DynamicImage::ImageLuma8(picture);
    match format {
        ImageFormat::WebP => picture_files::encode(&picture.to_rgb8().into(), format),
        _ => picture_files::encode(&picture, format),
    }
}

pub fn png(t: u32) -> Vec<u8> {
    encode(scene(t), ImageFormat::Png)
}

/// A picture of another size than the scene's.
pub fn png_of(width: u32, height: u32) -> Vec<u8> {
    let picture = GrayImage::from_fn(width, height, |x, y| Luma([(x * 3 + y * 5) as u8]));
    encode(picture, ImageFormat::Png)
}
