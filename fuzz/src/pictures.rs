//! Small pictures: a bright target that moves over a pattern.

use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use std::io::Cursor;

pub const WIDTH: u32 = 48;
pub const HEIGHT: u32 = 36;

/// Picture `t` in this size, as PNG.
pub fn pattern(t: u32, width: u32, height: u32) -> Vec<u8> {
    encode(t, width, height, ImageFormat::Png)
}

pub fn png(t: u32) -> Vec<u8> {
    pattern(t, WIDTH, HEIGHT)
}

pub fn jpeg(t: u32) -> Vec<u8> {
    encode(t, WIDTH, HEIGHT, ImageFormat::Jpeg)
}

/// Picture `t` as lossless WebP.
pub fn webp(t: u32) -> Vec<u8> {
    encode(t, WIDTH, HEIGHT, ImageFormat::WebP)
}

fn encode(t: u32, width: u32, height: u32, format: ImageFormat) -> Vec<u8> {
    let image = RgbImage::from_fn(width, height, |x, y| {
        let is_target = (16 + t..32 + t).contains(&x) && (12..24).contains(&y);
        match is_target {
            true => Rgb([200, ((x - t) * 11 ^ y * 7) as u8, 40]),
            false => Rgb([((x * 3) ^ (y * 5)) as u8 % 90, 90, 120]),
        }
    });
    let mut bytes = Cursor::new(Vec::new());
    let written = DynamicImage::ImageRgb8(image).write_to(&mut bytes, format);
    written.expect("a drawn picture is encoded");
    bytes.into_inner()
}
