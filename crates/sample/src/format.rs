//! The file formats of the frames.

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ImageResult, RgbImage};

const JPEG_QUALITY: u8 = 92;

/// How frames are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// Small files; the compression loses a little.
    #[default]
    Jpeg,
    /// Larger files, without loss.
    Png,
}

impl Format {
    pub(super) fn extension(self) -> &'static str {
        match self {
            Format::Jpeg => "jpg",
            Format::Png => "png",
        }
    }

    /// The bytes of a file with this picture.
    ///
    /// # Errors
    /// The encoder's error.
    pub fn encode(self, picture: &RgbImage) -> ImageResult<Vec<u8>> {
        let mut bytes = Vec::new();
        match self {
            Format::Jpeg => picture
                .write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY))?,
            Format::Png => picture.write_with_encoder(PngEncoder::new(&mut bytes))?,
        }
        Ok(bytes)
    }
}
