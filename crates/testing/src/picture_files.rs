//! Pictures that the tests draw and encode themselves.
use image::{DynamicImage, ImageFormat, Luma, RgbImage};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use std::io::Cursor;

/// A picture without symmetry: a ramp to the right and down, a bright corner, some texture.
pub fn color(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        if x < width / 4 && y < height / 3 {
            return image::Rgb([250, 240, 40]);
        }
        let wave = (f64::from(x) * 0.31).sin() * (f64::from(y) * 0.23).cos();
        let ramp = f64::from(x) / f64::from(width);
        let fall = f64::from(y) / f64::from(height);
        image::Rgb([
            (40.0 + 150.0 * ramp) as u8,
            (60.0 + 120.0 * fall + 30.0 * wave) as u8,
            (180.0 - 100.0 * ramp + 20.0 * wave) as u8,
        ])
    })
}

/// The luma of Rec. 601 in floating point, 0 to 255, to check the integer version against.
pub fn luma(rgb: [u8; 3]) -> f64 {
    0.299 * f64::from(rgb[0]) + 0.587 * f64::from(rgb[1]) + 0.114 * f64::from(rgb[2])
}

pub fn gray(width: u32, height: u32) -> image::GrayImage {
    let picture = color(width, height);
    image::GrayImage::from_fn(width, height, |x, y| {
        Luma([luma(picture.get_pixel(x, y).0).round() as u8])
    })
}

pub fn encode(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    image
        .write_to(&mut Cursor::new(&mut bytes), format)
        .expect("encoding a drawn picture works");
    bytes
}

/// A lossless WebP of 8192 x 4094 equal pixels: a few kilobytes, which take a worker tenths of a second to decode,
/// without interruption.
pub fn bomb() -> Vec<u8> {
    let picture = RgbImage::from_pixel(8192, 4094, image::Rgb([77; 3]));
    encode(&picture.into(), ImageFormat::WebP)
}

/// The options of a JPEG file.
#[derive(Debug, Clone, Copy)]
pub struct JpegForm {
    pub sampling: SamplingFactor,
    pub scans: Option<u8>,
    pub restart: Option<u16>,
    pub optimized: bool,
}

pub const BASELINE: JpegForm = JpegForm {
    sampling: SamplingFactor::R_4_2_0,
    scans: None,
    restart: None,
    optimized: false,
};

pub fn jpeg(picture: &RgbImage, form: JpegForm, exif_orientation: Option<u8>) -> Vec<u8> {
    jpeg_of(
        picture.as_raw(),
        picture.dimensions(),
        ColorType::Rgb,
        form,
        exif_orientation,
    )
}

pub fn jpeg_of(
    samples: &[u8],
    (width, height): (u32, u32),
    color: ColorType,
    form: JpegForm,
    exif_orientation: Option<u8>,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 92);
    encoder.set_sampling_factor(form.sampling);
    if let Some(scans) = form.scans {
        encoder.set_progressive_scans(scans);
    }
    if let Some(interval) = form.restart {
        encoder.set_restart_interval(interval);
    }
    encoder.set_optimized_huffman_tables(form.optimized);
    if let Some(orientation) = exif_orientation {
        encoder
            .add_app_segment(1, [b"Exif\0\0".to_vec(), exif(orientation)].concat())
            .expect("the segment is short");
    }
    encoder
        .encode(samples, width as u16, height as u16, color)
        .expect("encoding a drawn picture works");
    bytes
}

/// A TIFF block in big-endian order with one entry: the orientation, 1 to 8.
pub fn exif(orientation: u8) -> Vec<u8> {
    let mut block = b"MM\0\x2A\0\0\0\x08\0\x01".to_vec();
    block.extend([0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0]);
    block.extend([0; 4]);
    block
}

/// Every form of JPEG that the encoder writes, by name.
pub fn jpeg_forms() -> Vec<(String, JpegForm)> {
    let mut forms = Vec::new();
    for sampling in [
        SamplingFactor::R_4_4_4,
        SamplingFactor::R_4_4_0,
        SamplingFactor::R_4_2_2,
        SamplingFactor::R_4_2_0,
        SamplingFactor::R_4_1_1,
        SamplingFactor::R_4_1_0,
        SamplingFactor::R_4_4_1,
        SamplingFactor::R_4_2_1,
    ] {
        for scans in [None, Some(2), Some(6)] {
            for restart in [None, Some(3)] {
                // The encoder does not support optimized tables together with restart markers.
                for optimized in [false, restart.is_none()] {
                    let form = JpegForm {
                        sampling,
                        scans,
                        restart,
                        optimized,
                    };
                    forms.push((format!("{form:?}"), form));
                }
            }
        }
    }
    forms
}
