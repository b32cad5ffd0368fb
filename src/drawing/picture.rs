//! A decoded frame in colour.

use bagtrack_ingest::{IngestError, Limits};
use bagtrack_tracker::{Frame, FrameFormat, ycbcr};
use image::codecs::jpeg::{JpegEncoder, PixelDensity, PixelDensityUnit};
use image::{ImageFormat, ImageResult, RgbImage};
use std::io::Cursor;

const JPEG_QUALITY: u8 = 92;

/// A decoded frame in colour.
#[derive(Debug, Clone)]
pub struct Picture {
    pub(super) image: RgbImage,
    /// Pixels of the picture for each pixel of the uploaded frame, across and down.
    pub(super) scale: (f64, f64),
    /// The aspect ratio of a JPEG file's pixels, across and down: the pixels of many videos are no squares.
    density: Option<PixelDensity>,
}

impl Picture {
    /// The picture of a file, upright; with a longer side of more than `max_side` pixels it is reduced to that.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub fn decode(bytes: &[u8], limits: &Limits, max_side: u32) -> Result<Self, IngestError> {
        let format = |(width, height): (u32, u32)| {
            let longer = width.max(height);
            let scale = f64::from(max_side.min(longer)) / f64::from(longer);
            let reduced = |side: u32| ((f64::from(side) * scale).round() as u32).clamp(1, side);
            FrameFormat {
                size: (reduced(width), reduced(height)),
                has_color: true,
            }
        };
        let mut picture = Self::of(bagtrack_ingest::decode_to(bytes, limits, &format)?);
        picture.density = density(bytes);
        Ok(picture)
    }

    fn of(frame: Frame) -> Self {
        let (width, height) = (frame.width(), frame.height());
        let source = frame.source_size();
        let has_color = frame.has_color();
        let chroma_width = ycbcr::chroma_size((width, height)).0;
        let [luma, cb, cr] = frame.into_planes();
        let at = |plane: &[u8], x: u32, y: u32, width: u32| plane[(y * width + x) as usize];
        let image = RgbImage::from_fn(width, height, |x, y| {
            let gray = at(&luma, x, y, width);
            if !has_color {
                return image::Rgb([gray; 3]);
            }
            let chroma = |plane| f32::from(at(plane, x / 2, y / 2, chroma_width)) - 128.0;
            let (gray, blue, red) = (f32::from(gray), chroma(&cb), chroma(&cr));
            // YCbCr to RGB by BT.601 in full range.
            let color = [
                gray + 1.402 * red,
                gray - 0.344_136 * blue - 0.714_136 * red,
                gray + 1.772 * blue,
            ];
            image::Rgb(color.map(|value| value.round().clamp(0.0, 255.0) as u8))
        });
        Self {
            image,
            scale: (
                f64::from(width) / f64::from(source.0),
                f64::from(height) / f64::from(source.1),
            ),
            density: None,
        }
    }

    /// Bytes that its pixels take.
    pub fn bytes(&self) -> usize {
        self.image.as_raw().len()
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// The picture cannot be encoded.
    pub fn png(&self) -> ImageResult<Vec<u8>> {
        let mut bytes = Cursor::new(Vec::new());
        self.image.write_to(&mut bytes, ImageFormat::Png)?;
        Ok(bytes.into_inner())
    }

    /// The picture as a JPEG file.
    ///
    /// # Errors
    /// The picture has more than 65,535 pixels on a side.
    pub fn jpeg(&self) -> ImageResult<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
        if let Some(density) = self.density {
            encoder.set_pixel_density(density);
        }
        self.image.write_with_encoder(encoder)?;
        Ok(bytes)
    }
}

/// The aspect ratio of a JPEG file's pixels: the densities in its JFIF header, without their unit.
fn density(jpeg: &[u8]) -> Option<PixelDensity> {
    let jfif = jpeg.strip_prefix(&[0xff, 0xd8, 0xff, 0xe0])?.get(2..)?;
    // The densities follow the version and the unit.
    let sides = jfif.strip_prefix(b"JFIF\0")?.get(3..7)?;
    let side = |at: usize| u16::from_be_bytes([sides[at], sides[at + 1]]);
    let density = (side(0), side(2));
    (density.0 > 0 && density.1 > 0).then_some(PixelDensity {
        density,
        unit: PixelDensityUnit::PixelAspectRatio,
    })
}
