//! The frames that the load generator sends: the benchmarks' scene in colour, as JPEG.

use crate::bench_scene as scene;
use bagtrack_tracker::Rect;
use jpeg_encoder::{ColorType, Encoder, EncodingError, SamplingFactor};

pub use scene::{HEIGHT, WIDTH};

/// JPEGs (4:2:0, quality 85) of one round of the scene, with each pixel `zoom` x `zoom` times.
pub fn jpegs(zoom: usize) -> Result<Vec<Vec<u8>>, EncodingError> {
    let (width, height) = ((WIDTH * zoom) as u16, (HEIGHT * zoom) as u16);
    let jpeg = |t| {
        let luma = scene::luma(t, zoom);
        let rgb: Vec<u8> = luma
            .iter()
            .flat_map(|&y| [y, y / 2 + 60, 255 - y])
            .collect();
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 85);
        encoder.set_sampling_factor(SamplingFactor::F_2_2);
        encoder.encode(&rgb, width, height, ColorType::Rgb)?;
        Ok(bytes)
    };
    (0..scene::ROUND).map(jpeg).collect()
}

/// The target's box in the first frame, in pixels.
pub fn target(zoom: usize) -> Rect {
    scene::target(0).scaled(zoom as f64, zoom as f64)
}
