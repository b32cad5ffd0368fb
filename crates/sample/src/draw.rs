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

/// Moments of which a blurred frame is the mean.
const EXPOSURES: u32 = 8;

/// The wall, which does not move, drawn once, with as much around the frame as the camera may show.
#[derive(Debug)]
pub(super) struct Background {
    pixels: Vec<Color>,
    width: usize,
    margin: i32,
}

impl Background {
    pub(super) fn draw(settings: Settings) -> Self {
        let unit = unit(settings);
        let margin = (unit * settings.attributes.camera_motion).ceil() as i32;
        let [width, height] = [settings.width, settings.height].map(|side| side as i32);
        let mut pixels = Vec::new();
        for y in -margin..height + margin {
            for x in -margin..width + margin {
                let wall = |x, y| Some(texture::wall(x / unit, y / unit, settings.seed));
                pixels.push(average(x, y, wall).0);
            }
        }
        Self {
            pixels,
            width: (width + 2 * margin) as usize,
            margin,
        }
    }

    /// The wall in the frame when the camera has moved the picture by so many pixels to the right and down.
    fn seen(&self, settings: Settings, (right, down): (i32, i32)) -> Vec<Color> {
        let [left, top] = [self.margin - right, self.margin - down].map(|at| at as usize);
        let rows = self.pixels.chunks_exact(self.width).skip(top);
        rows.take(settings.height as usize)
            .flat_map(|row| &row[left..left + settings.width as usize])
            .copied()
            .collect()
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
    let pixels = exposed(settings, timeline, background, index);
    let light = 255.0 * timeline.light(index);
    // One stream of noise a frame, so that any frame can be drawn by itself.
    let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
    random.set_stream(u64::from(index) + 1);
    let noise = Normal::new(0.0, NOISE).expect("the deviation is a positive constant");
    RgbImage::from_fn(settings.width, settings.height, |x, y| {
        let color = pixels[(y * settings.width + x) as usize];
        Rgb(color.map(|channel| (channel * light + noise.sample(&mut random)).round() as u8))
    })
}

/// What is seen while the shutter is open, up to the moment of the frame.
fn exposed(
    settings: Settings,
    timeline: &Timeline,
    background: &Background,
    index: u32,
) -> Vec<Color> {
    let blur = settings.attributes.motion_blur;
    if blur == 0.0 || index == 0 {
        return seen(settings, timeline, background, index, 0.0);
    }
    let moments = (0..EXPOSURES).map(|moment| blur * f64::from(moment) / f64::from(EXPOSURES));
    let mut mean = vec![[0.0; 3]; (settings.width * settings.height) as usize];
    for before in moments {
        let pixels = seen(settings, timeline, background, index, before);
        for (mean, color) in mean.iter_mut().zip(pixels) {
            *mean = std::array::from_fn(|channel| {
                mean[channel] + color[channel] / f64::from(EXPOSURES)
            });
        }
    }
    mean
}

/// What is seen `before` the moment of a frame; `before` is a share of the time between two frames.
fn seen(
    settings: Settings,
    timeline: &Timeline,
    background: &Background,
    index: u32,
    before: f64,
) -> Vec<Color> {
    let (last, now) = (
        timeline.camera(index.saturating_sub(1)),
        timeline.camera(index),
    );
    let between = |last: i32, now: i32| now + (before * f64::from(last - now)).round() as i32;
    let camera = (between(last.0, now.0), between(last.1, now.1));
    let mut pixels = background.seen(settings, camera);
    let (seed, unit) = (settings.seed, unit(settings));
    let earlier = index.saturating_sub(1);
    let similar = timeline.similar(index).zip(timeline.similar(earlier));
    let card = (timeline.card(index), timeline.card(earlier));
    for (now, last) in similar.chain([card]) {
        let pose = now.towards(&last, before);
        lay(&mut pixels, settings, pose.bounds(), |x, y| {
            let (u, v) = pose.on_card(x, y)?;
            Some(texture::card(u, v, seed))
        });
    }
    if let Some(board) = timeline.board(index) {
        lay(&mut pixels, settings, board, |x, y| {
            let inside = (board.x..board.x + board.width).contains(&x)
                && (board.y..board.y + board.height).contains(&y);
            inside.then(|| texture::board((x - board.x) / unit, (y - board.y) / unit, seed))
        });
    }
    pixels
}

/// Lays a surface over the pixels that `area` touches, by the share of each that it covers.
fn lay(
    pixels: &mut [Color],
    settings: Settings,
    area: Rect,
    surface: impl Fn(f64, f64) -> Option<Color>,
) {
    let span = |from: f64, length: f64, limit: u32| {
        (from.floor().max(0.0) as u32)..((from + length).ceil().clamp(0.0, f64::from(limit)) as u32)
    };
    for y in span(area.y, area.height, settings.height) {
        for x in span(area.x, area.width, settings.width) {
            let (color, share) = average(x as i32, y as i32, &surface);
            let pixel = &mut pixels[(y * settings.width + x) as usize];
            *pixel = texture::mix(*pixel, color, share);
        }
    }
}

/// The mean colour over the pixel at column `x`, row `y`, of the points where there is a colour, and their share.
fn average(x: i32, y: i32, color: impl Fn(f64, f64) -> Option<Color>) -> (Color, f64) {
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
