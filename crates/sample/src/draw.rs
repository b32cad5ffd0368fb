//! A frame: the wall, the card, the board, each averaged over the area of a pixel; then light and sensor noise.

use super::settings::Settings;
use super::texture::{self, Color};
use super::timeline::Timeline;
use bagtrack_tracker::Rect;
use image::{Rgb, RgbImage};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Samples across and down a pixel.
const SAMPLES: u32 = 4;
/// Standard deviation of the sensor's noise, of 255.
const NOISE: f64 = 2.5;

/// The wall, which does not move, drawn once.
#[derive(Debug)]
pub(super) struct Background {
    pixels: Vec<Color>,
}

impl Background {
    pub(super) fn draw(settings: Settings) -> Self {
        let unit = unit(settings);
        let mut pixels = Vec::with_capacity((settings.width * settings.height) as usize);
        for y in 0..settings.height {
            for x in 0..settings.width {
                pixels.push(
                    average(x, y, |x, y| {
                        Some(texture::wall(x / unit, y / unit, settings.seed))
                    })
                    .0,
                );
            }
        }
        Self { pixels }
    }
}

/// Length of the scene's unit in pixels: the shorter side.
fn unit(settings: Settings) -> f64 {
    f64::from(settings.width.min(settings.height))
}

pub(super) fn frame(
    settings: Settings,
    timeline: &Timeline,
    background: &Background,
    index: u32,
) -> RgbImage {
    let mut pixels = background.pixels.clone();
    let (seed, unit) = (settings.seed, unit(settings));
    let card = timeline.target(index);
    lay(&mut pixels, settings, card, |x, y| {
        texture::card((x - card.x) / card.width, (y - card.y) / card.height, seed)
    });
    if let Some(board) = timeline.board(index) {
        lay(&mut pixels, settings, board, |x, y| {
            texture::board((x - board.x) / unit, (y - board.y) / unit, seed)
        });
    }
    let light = 255.0 * timeline.light(index);
    // One stream of noise a frame, so that any frame can be drawn by itself.
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::from(index) + 1);
    let noise = Normal::new(0.0, NOISE).expect("the deviation is a positive constant");
    RgbImage::from_fn(settings.width, settings.height, |x, y| {
        let color = pixels[(y * settings.width + x) as usize];
        Rgb(color.map(|channel| (channel * light + noise.sample(&mut random)).round() as u8))
    })
}

/// Lays a surface over the pixels that `area` touches, by the share of each that it covers.
fn lay(pixels: &mut [Color], settings: Settings, area: Rect, surface: impl Fn(f64, f64) -> Color) {
    let span = |from: f64, length: f64, limit: u32| {
        (from.floor().max(0.0) as u32)..((from + length).ceil().clamp(0.0, f64::from(limit)) as u32)
    };
    for y in span(area.y, area.height, settings.height) {
        for x in span(area.x, area.width, settings.width) {
            let (color, share) = average(x, y, |x, y| {
                let inside = (area.x..area.x + area.width).contains(&x)
                    && (area.y..area.y + area.height).contains(&y);
                inside.then(|| surface(x, y))
            });
            let pixel = &mut pixels[(y * settings.width + x) as usize];
            *pixel = texture::mix(*pixel, color, share);
        }
    }
}

/// The mean colour over the pixel at column `x`, row `y`, of the points where there is a colour, and their share.
fn average(x: u32, y: u32, color: impl Fn(f64, f64) -> Option<Color>) -> (Color, f64) {
    let (mut sum, mut hits) = ([0.0; 3], 0u32);
    for sample in 0..SAMPLES * SAMPLES {
        let offset = |step: u32| (f64::from(step) + 0.5) / f64::from(SAMPLES);
        let across = f64::from(x) + offset(sample % SAMPLES);
        let down = f64::from(y) + offset(sample / SAMPLES);
        if let Some(found) = color(across, down) {
            sum = std::array::from_fn(|channel| sum[channel] + found[channel]);
            hits += 1;
        }
    }
    let mean = sum.map(|channel| channel / f64::from(hits.max(1)));
    (mean, f64::from(hits) / f64::from(SAMPLES * SAMPLES))
}
