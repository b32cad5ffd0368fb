//! The clip as a folder in the OTB layout.

use super::{Clip, SampleError};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ImageResult, RgbImage};
use std::fs;
use std::path::Path;

const JPEG_QUALITY: u8 = 92;

/// How frames are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// Small; the pictures lose a little.
    #[default]
    Jpeg,
    /// Exact.
    Png,
}

impl Format {
    fn extension(self) -> &'static str {
        match self {
            Format::Jpeg => "jpg",
            Format::Png => "png",
        }
    }

    fn encode(self, picture: &RgbImage) -> ImageResult<Vec<u8>> {
        let mut bytes = Vec::new();
        match self {
            Format::Jpeg => picture
                .write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY))?,
            Format::Png => picture.write_with_encoder(PngEncoder::new(&mut bytes))?,
        }
        Ok(bytes)
    }
}

pub(super) fn write(
    clip: &Clip,
    dir: &Path,
    format: Format,
    mut progress: impl FnMut(),
) -> Result<(), SampleError> {
    let failed = |path: &Path, reason: String| SampleError::Write {
        path: path.to_owned(),
        reason,
    };
    let pictures = dir.join("img");
    fs::create_dir_all(&pictures).map_err(|error| failed(&pictures, error.to_string()))?;
    let (mut truth, mut seen) = (String::new(), String::new());
    for index in 0..clip.frames() {
        let path = pictures.join(format!("{:04}.{}", index + 1, format.extension()));
        let bytes = format
            .encode(&clip.draw(index))
            .map_err(|error| failed(&path, error.to_string()))?;
        fs::write(&path, bytes).map_err(|error| failed(&path, error.to_string()))?;
        let card = clip.target(index);
        if clip.visible(index) > 0.0 {
            truth += &format!(
                "{:.3},{:.3},{:.3},{:.3}\n",
                card.x + 1.0,
                card.y + 1.0,
                card.width,
                card.height
            );
            seen += "1\n";
        } else {
            truth += "0,0,0,0\n";
            seen += "0\n";
        }
        progress();
    }
    for (name, text) in [("groundtruth_rect.txt", truth), ("visible.txt", seen)] {
        let path = dir.join(name);
        fs::write(&path, text).map_err(|error| failed(&path, error.to_string()))?;
    }
    Ok(())
}
