//! A PNG of 400 KB whose colour profile unpacks to 200 MB beside an image of 16 bits a channel.

use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use image::{DynamicImage, ImageBuffer, ImageFormat, Rgba};
use std::io::{Cursor, Write};

pub const SETTINGS: &[&str] = &[];

/// Where the chunks after `IHDR` begin.
const AFTER_HEADER: usize = 8 + 25;

fn png(side: u32) -> Outcome<Vec<u8>> {
    let picture = ImageBuffer::from_pixel(side, side, Rgba([700u16, 9000, 30_000, 65_535]));
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::ImageRgba16(picture).write_to(&mut bytes, ImageFormat::Png)?;
    let mut png = bytes.into_inner();
    let mut profile = ZlibEncoder::new(b"profile\0\0".to_vec(), Compression::fast());
    let zeros = vec![0; 1 << 20];
    for _ in 0..200 {
        profile.write_all(&zeros)?;
    }
    let data = [b"iCCP".as_slice(), &profile.finish()?].concat();
    let length = (data.len() as u32 - 4).to_be_bytes();
    let checksum = crc32fast::hash(&data).to_be_bytes();
    let chunk = [&length, data.as_slice(), &checksum].concat();
    png.splice(AFTER_HEADER..AFTER_HEADER, chunk);
    Ok(png)
}

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let png = png(4900)?;
    let before = target.memory("VmRSS:");
    let request = target.post("198.51.100.1", "/sessions?box=1000,1000,900,900");
    let status = request.body(png.clone()).send().await?.status();
    let (Some(before), Some(peak)) = (before, target.memory("VmHWM:")) else {
        let seen = format!("{status}; memory not measured");
        return Ok(Verdict::new(!target.is_own(), seen));
    };
    let cost = (peak - before) >> 20;
    // What decoding may take, and the upload itself.
    let seen = format!("{} KB, {status}, {cost} MiB at most", png.len() / 1000);
    Ok(Verdict::new(cost <= 256 + 8, seen))
}
