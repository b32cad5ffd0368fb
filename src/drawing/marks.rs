//! Boxes and particles on a picture.

use super::label::{self, HEIGHT, WIDTH};
use super::picture::Picture;
use bagtrack_tracker::{Estimate, Rect, Status};
use image::{Rgb, RgbImage};

const PARTICLE: Rgb<u8> = Rgb([255, 240, 60]);
/// How opaque particles of the least and of the greatest weight are, from 0 to 1.
const COVER: [f64; 2] = [0.25, 0.9];

/// What is drawn of one target.
#[derive(Debug, Clone, Copy)]
pub struct Drawn<'a> {
    /// The target's number, where there are several.
    pub number: Option<usize>,
    /// The answer.
    pub estimate: &'a Estimate,
    /// The particles with their weights.
    pub particles: &'a [(Rect, f64)],
}

/// Draws targets on a picture: their particles, boxes and scores.
pub fn draw(picture: &mut Picture, targets: &[Drawn]) {
    let (across, down) = picture.scale;
    let scaled = |area: &Rect| {
        let (x, y) = (area.x * across, area.y * down);
        Rect::new(x, y, area.width * across, area.height * down)
    };
    let image = &mut picture.image;
    let thickness = 1 + image.width().max(image.height()) / 320;
    for target in targets {
        let most = target.particles.iter().map(|(_, weight)| *weight);
        let most = most.fold(f64::MIN_POSITIVE, f64::max);
        for (area, weight) in target.particles {
            dot(
                image,
                scaled(area).center(),
                thickness,
                COVER[0] + (COVER[1] - COVER[0]) * weight / most,
            );
        }
        let color = color_of(target.estimate.status);
        let outlined = scaled(&target.estimate.target);
        outline(image, &outlined, f64::from(thickness), color);
        write(
            image,
            &text_of(target),
            &outlined,
            thickness.div_ceil(2),
            color,
        );
    }
}

fn color_of(status: Status) -> Rgb<u8> {
    match status {
        Status::Tracking => Rgb([40, 220, 60]),
        Status::Uncertain => Rgb([255, 165, 0]),
        Status::Lost => Rgb([230, 30, 30]),
    }
}

fn text_of(target: &Drawn) -> String {
    let score = match target.estimate.status {
        Status::Lost => format!("{:.2} lost", target.estimate.score),
        _ => format!("{:.2}", target.estimate.score),
    };
    match target.number {
        Some(number) => format!("{number}: {score}"),
        None => score,
    }
}

/// Draws a square of `side` pixels with the opacity `cover`, in [0, 1].
fn dot(image: &mut RgbImage, (x, y): (f64, f64), side: u32, cover: f64) {
    let half = f64::from(side) / 2.0;
    for y in span(y - half, y + half, image.height()) {
        for x in span(x - half, x + half, image.width()) {
            let pixel = image.get_pixel_mut(x, y);
            for (value, of_particle) in pixel.0.iter_mut().zip(PARTICLE.0) {
                let before = f64::from(*value);
                *value = (before + cover * (f64::from(of_particle) - before)).round() as u8;
            }
        }
    }
}

/// The pixels from `from` to `to`, both rounded, that are below `limit`.
fn span(from: f64, to: f64, limit: u32) -> std::ops::Range<u32> {
    let clamp = |edge: f64| edge.round().clamp(0.0, f64::from(limit)) as u32;
    clamp(from)..clamp(to)
}

/// Draws the border of the box inwards; what is outside the picture is left out.
fn outline(image: &mut RgbImage, target: &Rect, thickness: f64, color: Rgb<u8>) {
    let (left, top) = (target.x.round(), target.y.round());
    let right = (target.x + target.width).round();
    let bottom = (target.y + target.height).round();
    for y in span(top, bottom, image.height()) {
        for x in span(left, right, image.width()) {
            let (across, down) = (f64::from(x), f64::from(y));
            let to_border = (across - left)
                .min(right - 1.0 - across)
                .min(down - top)
                .min(bottom - 1.0 - down);
            if to_border < thickness {
                image.put_pixel(x, y, color);
            }
        }
    }
}

/// Writes a text above the box, or below it where there is no room above, on a background of this colour. What does not
/// fit into the picture is left out.
fn write(image: &mut RgbImage, text: &str, target: &Rect, size: u32, color: Rgb<u8>) {
    let margin = size;
    let width = text.len() as u32 * WIDTH * size + 2 * margin;
    let height = HEIGHT * size + 2 * margin;
    let last = |whole: u32, part: u32| f64::from(whole.saturating_sub(part));
    let above = target.y.round() - f64::from(height);
    let top = match above < 0.0 {
        true => (target.y + target.height).round(),
        false => above,
    };
    let top = top.clamp(0.0, last(image.height(), height)) as u32;
    let left = target.x.round().clamp(0.0, last(image.width(), width)) as u32;
    for y in top..(top + height).min(image.height()) {
        for x in left..(left + width).min(image.width()) {
            let in_text = (x - left)
                .checked_sub(margin)
                .zip((y - top).checked_sub(margin));
            let is_ink = in_text.is_some_and(|(x, y)| label::is_ink(text, x / size, y / size));
            image.put_pixel(x, y, if is_ink { Rgb([0; 3]) } else { color });
        }
    }
}
