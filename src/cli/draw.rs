//! Frames with the box drawn on them.

use bagtrack::drawing::{self, Drawn, Picture};
use bagtrack_ingest::Limits;
use bagtrack_tracker::Estimate;
use std::error::Error;

/// The frame as JPEG, upright, with the box and the score.
pub fn with_box(bytes: &[u8], estimate: &Estimate) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut picture = Picture::decode(bytes, &Limits::default(), u32::MAX)?;
    let drawn = Drawn {
        number: None,
        estimate,
        particles: &[],
    };
    drawing::draw(&mut picture, &[drawn]);
    Ok(picture.jpeg()?)
}
