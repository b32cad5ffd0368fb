//! The pictures that callers send: some clips, drawn and encoded once.

use bagtrack_tracker::Rect;
use bytes::Bytes;
use image::{DynamicImage, GrayImage, ImageFormat, Luma};
use std::io::Cursor;
use std::sync::OnceLock;

pub const CLIPS: usize = 4;
pub const PICTURES: usize = 24;
const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const SIDE: u32 = 12;

/// A picture of a clip, as PNG. After the last picture of the clip the first comes again.
pub fn picture(clip: usize, index: usize) -> Bytes {
    static PICTURES_OF: OnceLock<Vec<Vec<Bytes>>> = OnceLock::new();
    let clips = PICTURES_OF.get_or_init(|| {
        let clip = |clip| (0..PICTURES).map(|index| draw(clip, index)).collect();
        (0..CLIPS).map(clip).collect()
    });
    clips[clip][index % PICTURES].clone()
}

pub fn target(clip: usize, index: usize) -> Rect {
    let (x, y) = corner(clip, index % PICTURES);
    Rect::new(x.into(), y.into(), SIDE.into(), SIDE.into())
}

fn corner(clip: usize, index: usize) -> (u32, u32) {
    let (clip, index) = (clip as u32, index as u32);
    (
        8 + (index * (1 + clip % 2)) % 40,
        6 + (index * (1 + clip / 2)) / 2 % 28,
    )
}

/// A textured square on a textured ground.
fn draw(clip: usize, index: usize) -> Bytes {
    let ((left, top), clip) = (corner(clip, index), clip as u32);
    let picture = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let (dx, dy) = (x.wrapping_sub(left), y.wrapping_sub(top));
        Luma([if dx < SIDE && dy < SIDE {
            150 + ((dx * (5 + clip)) ^ (dy * 9)) as u8 % 100
        } else {
            40 + ((x * 3) ^ (y * (7 + clip))) as u8 % 60
        }])
    });
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::ImageLuma8(picture)
        .write_to(&mut bytes, ImageFormat::Png)
        .expect("memory takes it");
    bytes.into_inner().into()
}
