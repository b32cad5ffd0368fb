//! A turn of the picture around a point: where things are before and after, and what is seen then.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;
use crate::tracker::motion::particles::Particle;

/// Places between pixels are counted in so many parts, as a power of two, and mixed in [`SHARES`] shares.
const PARTS: u32 = 16;
const SHARES: u32 = 256;
/// Pixels that are mixed at once.
const GROUP_SIZE: usize = 16;

/// A turn around a point. The picture that it makes is the *turned* one; a target that has turned by as much in the picture
/// stands upright there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotation {
    x: f64,
    y: f64,
    sin: f64,
    cos: f64,
}

/// The pixels of [`Rotation::apply`], to be compiled for the instructions that this machine has.
struct Mix<'a> {
    rotation: Rotation,
    frame: &'a GrayFrame,
    columns: Range<usize>,
    rows: Range<usize>,
    out: &'a mut [u8],
}

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let width = self.frame.width() as usize;
        for row in self.rows {
            let out = &mut self.out[row * width..][self.columns.clone()];
            self.rotation
                .mix_row(self.frame, (self.columns.start, row), out);
        }
    }
}

impl Rotation {
    /// Around the centre of `target`, by `angle` radians: clockwise as the picture is seen, for y points down.
    pub fn about(target: &Particle, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let (x, y) = (target.x, target.y);
        Self { x, y, sin, cos }
    }

    /// Where `particle` of the turned picture is in the picture itself.
    pub fn to_original(&self, particle: &Particle) -> Particle {
        let (x, y) = (particle.x - self.x, particle.y - self.y);
        Particle {
            x: self.x + self.cos * x - self.sin * y,
            y: self.y + self.sin * x + self.cos * y,
            scale: particle.scale,
        }
    }

    /// What a displacement in the picture is in the turned one.
    pub fn rotated_displacement(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.cos * x + self.sin * y, self.cos * y - self.sin * x)
    }

    /// `frame` turned, within `window` (working pixels of the turned picture); outside of it is what was there before. Gray
    /// values between pixels by bilinear interpolation, beyond the edge what is at the edge. `scratch` is memory, whatever it
    /// holds.
    pub fn apply(&self, frame: &GrayFrame, window: &Rect, mut scratch: Vec<u8>) -> GrayFrame {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let source = frame.pixels();
        scratch.clear();
        scratch.extend_from_slice(source);
        let span = |from: f64, length: f64, limit: usize| {
            let held = |at: f64| at.clamp(0.0, limit as f64) as usize;
            held(from.floor())..held((from + length).ceil())
        };
        let window = window.in_pixels_of(frame.downsample());
        let columns = span(window.x, window.width, width);
        let rows = span(window.y, window.height, height);
        // Of one row or column there is nothing to mix.
        if width > 1 && height > 1 {
            Arch::new().dispatch(Mix {
                rotation: Self {
                    x: self.x / frame.downsample(),
                    y: self.y / frame.downsample(),
                    ..*self
                },
                frame,
                columns,
                rows,
                out: &mut scratch,
            });
        }
        frame.with_pixels(scratch)
    }

    /// Writes the pixels of the turned picture from this `column` and `row` on to `out`.
    #[inline(always)]
    fn mix_row(&self, frame: &GrayFrame, (column, row): (usize, usize), out: &mut [u8]) {
        let parts = f64::from(1_u32 << PARTS);
        let part = |value: f64| (value * parts).round() as i32;
        // A pixel's centre is half a pixel from its edge.
        let (x, y) = (column as f64 + 0.5 - self.x, row as f64 + 0.5 - self.y);
        let across = Line {
            start: part(self.x + self.cos * x - self.sin * y - 0.5),
            step: part(self.cos),
            last: frame.width() as i32 - 1,
        };
        let along = Line {
            start: part(self.y + self.sin * x + self.cos * y - 0.5),
            step: part(self.sin),
            last: frame.height() as i32 - 1,
        };
        // Few are beyond the edge, and only these have to be held.
        let inside = along.inside(across.inside(0..out.len()));
        let (source, width) = (frame.pixels(), frame.width() as usize);
        let mut done = inside.start;
        if inside.len() >= GROUP_SIZE {
            while done < inside.end {
                // Some of the last ones twice, where they do not come out even.
                let first = done.min(inside.end - GROUP_SIZE);
                let mixed =
                    mix_several(source, width, &across.several(first), &along.several(first));
                out[first..][..GROUP_SIZE].copy_from_slice(&mixed);
                done = first + GROUP_SIZE;
            }
        }
        for i in (0..inside.start).chain(done..out.len()) {
            let ((x, to_right), (y, down)) = (across.held(i), along.held(i));
            let upper = y * width + x;
            let [left, right] = [upper, upper + 1].map(|at| {
                let [above, below] = [source[at], source[at + width]].map(u32::from);
                above * (SHARES - down) + below * down
            });
            out[i] = rounded(left * (SHARES - to_right) + right * to_right);
        }
    }
}

/// The gray values at these places, none of which is beyond the last pixel.
#[inline(always)]
fn mix_several(
    source: &[u8],
    width: usize,
    x: &[i32; GROUP_SIZE],
    y: &[i32; GROUP_SIZE],
) -> [u8; GROUP_SIZE] {
    let uppers: [u32; GROUP_SIZE] =
        std::array::from_fn(|i| ((y[i] >> PARTS) * width as i32 + (x[i] >> PARTS)) as u32);
    let (mut above, mut below) = ([0_u16; GROUP_SIZE], [0_u16; GROUP_SIZE]);
    for ((upper, above), below) in uppers.iter().zip(&mut above).zip(&mut below) {
        let square = &source[*upper as usize..][..width + 2];
        *above = u16::from_le_bytes([square[0], square[1]]);
        *below = u16::from_le_bytes([square[width], square[width + 1]]);
    }
    std::array::from_fn(|i| {
        let across = share(x[i]);
        let line = |pair: u16| {
            let (left, right) = (u32::from(pair & 0xff), u32::from(pair >> 8));
            left * (SHARES - across) + right * across
        };
        let down = share(y[i]);
        rounded(line(above[i]) * (SHARES - down) + line(below[i]) * down)
    })
}

/// The gray value of which these are shares of shares.
#[inline(always)]
fn rounded(mixed: u32) -> u8 {
    ((mixed + SHARES * SHARES / 2) / (SHARES * SHARES)) as u8
}

/// Where the pixels of a row of the turned picture are along one axis of the picture itself, in parts of a pixel.
#[derive(Debug, Clone, Copy)]
struct Line {
    start: i32,
    step: i32,
    /// The last pixel of the picture, in pixels: at least 1.
    last: i32,
}

impl Line {
    #[inline(always)]
    fn at(&self, index: usize) -> i32 {
        self.start + index as i32 * self.step
    }

    #[inline(always)]
    fn several(&self, first: usize) -> [i32; GROUP_SIZE] {
        std::array::from_fn(|i| self.at(first + i))
    }

    /// Which of the pixels in `run` are at or after the first pixel and before the last one.
    #[inline(always)]
    fn inside(&self, run: Range<usize>) -> Range<usize> {
        let (start, limit) = (self.start, self.last << PARTS);
        let (first, end) = match self.step {
            0 if (0..limit).contains(&start) => return run,
            0 => (0, 0),
            step @ 1.. => (-start.div_euclid(step), -(start - limit).div_euclid(step)),
            step => {
                let back = |from: i32| from.div_euclid(-step) + 1;
                (back(start - limit), back(start))
            }
        };
        let held = |index: i32| (index.max(0) as usize).clamp(run.start, run.end);
        held(first)..held(end).max(held(first))
    }

    /// The pixel before the place of pixel `index`, and the share of the one after it: there is one, for the last pixel is all of the
    /// one after the last but one.
    fn held(&self, index: usize) -> (usize, u32) {
        let at = self.at(index).clamp(0, self.last << PARTS);
        if at >> PARTS == self.last {
            return (self.last as usize - 1, SHARES);
        }
        ((at >> PARTS) as usize, share(at))
    }
}

/// The share of the pixel after a place, which is given in parts.
#[inline(always)]
fn share(at: i32) -> u32 {
    ((at as u32 & ((1 << PARTS) - 1)) * SHARES) >> PARTS
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: Particle = Particle {
        x: 40.0,
        y: 30.0,
        scale: 1.0,
    };

    fn frame(gray: impl Fn(usize, usize) -> u8) -> GrayFrame {
        let pixels = (0..80 * 60).map(|i| gray(i % 80, i / 80)).collect();
        GrayFrame::from_luma(80, 60, pixels).expect("a frame of this size")
    }

    fn everywhere() -> Rect {
        Rect::new(0.0, 0.0, 80.0, 60.0)
    }

    /// In floating point, a pixel at a time.
    fn textbook(frame: &GrayFrame, angle: f64) -> Vec<f64> {
        let (sin, cos) = angle.sin_cos();
        let at = |x: f64, y: f64| {
            let (x, y) = ((x - 0.5).clamp(0.0, 79.0), (y - 0.5).clamp(0.0, 59.0));
            let pixel = |x: f64, y: f64| {
                let (x, y) = (x.min(79.0) as usize, y.min(59.0) as usize);
                f64::from(frame.pixels()[y * 80 + x])
            };
            let (left, up) = (x.floor(), y.floor());
            let line = |y: f64| {
                let (a, b) = (pixel(left, y), pixel(left + 1.0, y));
                a + (b - a) * x.fract()
            };
            line(up) + (line(up + 1.0) - line(up)) * y.fract()
        };
        let place = |i: usize| ((i % 80) as f64 + 0.5 - 40.0, (i / 80) as f64 + 0.5 - 30.0);
        (0..80 * 60)
            .map(place)
            .map(|(x, y)| at(40.0 + cos * x - sin * y, 30.0 + sin * x + cos * y))
            .collect()
    }

    #[test]
    fn a_turned_picture_is_that_of_the_textbook() {
        let original = frame(|x, y| ((x * x / 3 + y * 5) % 200) as u8);
        for angle in [0.0_f64, 0.3, -1.2, 3.0] {
            let rotated = Rotation::about(&TARGET, angle);
            let rotated = rotated.apply(&original, &everywhere(), vec![9; 7]);
            for (found, expected) in rotated.pixels().iter().zip(textbook(&original, angle)) {
                let off = (f64::from(*found) - expected).abs();
                // Shares of a 256th, along both axes, of a step of up to 200.
                assert!(off <= 2.1, "{angle}: {found} {expected}");
            }
        }
        let still = Rotation::about(&TARGET, 0.0);
        let still = still.apply(&original, &everywhere(), Vec::new());
        assert_eq!(still.pixels()[..79], original.pixels()[..79]);
    }

    #[test]
    fn outside_the_window_nothing_changes() {
        let original = frame(|x, y| ((x * 7 + y * 3) % 251) as u8);
        let rotation = Rotation::about(&TARGET, 0.5);
        let window = Rect::new(30.0, 20.0, 20.0, 15.0);
        let part = rotation.apply(&original, &window, Vec::new());
        let whole = rotation.apply(&original, &everywhere(), Vec::new());
        for (i, pixel) in part.pixels().iter().enumerate() {
            let inside = (30..50).contains(&(i % 80)) && (20..35).contains(&(i / 80));
            let expected = if inside { &whole } else { &original };
            assert_eq!(*pixel, expected.pixels()[i], "{i}");
        }
        let beyond = Rect::new(200.0, -90.0, 20.0, 15.0);
        assert_eq!(rotation.apply(&original, &beyond, Vec::new()), original);
    }

    #[test]
    fn what_is_at_a_place_of_the_turned_picture_is_where_that_is_in_the_picture() {
        let dot = |x: usize, y: usize| if (x, y) == (60, 20) { 255 } else { 0 };
        let original = frame(dot);
        for angle in [0.4, -0.7, 2.0] {
            let rotation = Rotation::about(&TARGET, angle);
            let rotated = rotation.apply(&original, &everywhere(), Vec::new());
            let brightest = (0..80 * 60).max_by_key(|&i| rotated.pixels()[i]);
            let brightest = brightest.expect("there are pixels");
            let there = Particle {
                x: (brightest % 80) as f64 + 0.5,
                y: (brightest / 80) as f64 + 0.5,
                scale: 1.0,
            };
            let here = rotation.to_original(&there);
            assert!((here.x - 60.5).abs() < 1.0 && (here.y - 20.5).abs() < 1.0);
            let shift = rotation.rotated_displacement((here.x - TARGET.x, here.y - TARGET.y));
            assert!((TARGET.x + shift.0 - there.x).abs() < 1e-9);
            assert!((TARGET.y + shift.1 - there.y).abs() < 1e-9);
        }
    }

    #[test]
    fn the_thinnest_pictures_stay() {
        for (width, height) in [(1, 5), (5, 1), (1, 1)] {
            let pixels = (0..width * height).map(|i| i as u8).collect();
            let frame = GrayFrame::from_luma(width, height, pixels).expect("of this size");
            let window = Rect::new(-5.0, -5.0, 20.0, 20.0);
            let rotation = Rotation::about(&TARGET, 1.0);
            assert_eq!(rotation.apply(&frame, &window, Vec::new()), frame);
        }
    }
}
