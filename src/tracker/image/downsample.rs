//! A frame in larger pixels, for a large target: each is the mean of a square of the frame's own.
//!
//! Gradients and their sums are made of every pixel around the target, so a large one costs as many times more, and says no
//! more: what is compared are cells of it, of which there are always as many. Squares that the edge cuts are left out.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::features::extractor::Extractor;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::motion::particles::{Particle, StateBounds};
use crate::tracker::params::table::Features;
use crate::tracker::params::table::Params;

/// Pixels along the shorter side of a cell, at least. With 4 a car's growth in the picture is measured too poorly, and the box does not follow it.
const FINEST: f64 = 6.0;
/// The same once the target has become smaller: what is remembered was seen in pixels as large as at first.
const SHRUNK: f64 = 4.0;
/// The greatest side of a square.
const GREATEST: usize = 4;

/// Along how many pixels of the frame one of the picture goes in which `target` is looked at: 1, 2 or 4.
pub(crate) fn downsample(target: &Particle, bounds: &StateBounds, params: &Params) -> usize {
    if params.features == Features::Gray {
        return 1;
    }
    let first = Particle {
        scale: 1.0,
        ..*target
    };
    let (width, height) = Extractor::cell(&first, bounds, params);
    let shorter = width.min(height);
    // A box may be larger than the frame, which has to have a pixel.
    let most = bounds.frame_width.min(bounds.frame_height);
    let mut downsample = 1;
    while downsample < GREATEST {
        let next = (2 * downsample) as f64;
        if shorter < FINEST * next || shorter * target.scale < SHRUNK * next || next > most {
            break;
        }
        downsample *= 2;
    }
    downsample
}

/// `frame` in pixels of `downsample` = 2 or 4 by as many of its own. `scratch` is memory, whatever it holds.
pub(crate) fn picture(frame: &GrayFrame, downsample: usize, mut scratch: Vec<u8>) -> GrayFrame {
    let (width, height) = (
        frame.width() as usize / downsample,
        frame.height() as usize / downsample,
    );
    scratch.clear();
    scratch.resize(width * height, 0);
    Arch::new().dispatch(Average {
        frame,
        downsample,
        width,
        out: &mut scratch,
    });
    frame.coarse(downsample as u32, (width as u32, height as u32), scratch)
}

/// The means of [`picture`], to be compiled for the instructions that this machine has.
struct Average<'a> {
    frame: &'a GrayFrame,
    downsample: usize,
    width: usize,
    out: &'a mut [u8],
}

impl WithSimd for Average<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        if self.downsample == 2 {
            self.average::<2>();
        } else {
            self.average::<4>();
        }
    }
}

impl Average<'_> {
    #[inline(always)]
    fn average<const FACTOR: usize>(self) {
        let source_width = self.frame.width() as usize;
        let rows = self.frame.pixels().chunks_exact(FACTOR * source_width);
        for (out, rows) in self.out.chunks_exact_mut(self.width).zip(rows) {
            let lines: [&[[u8; FACTOR]]; FACTOR] = std::array::from_fn(|row| {
                let line = &rows[row * source_width..][..source_width];
                &line.as_chunks::<FACTOR>().0[..out.len()]
            });
            for (i, out) in out.iter_mut().enumerate() {
                let square = lines.iter().flat_map(|line| line[i]);
                let sum: u16 = square.map(u16::from).sum();
                let count = (FACTOR * FACTOR) as u16;
                *out = ((sum + count / 2) / count) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::params::presets::Preset;

    #[test]
    fn pixels_are_the_means_of_whole_squares() {
        let gray = |x: usize, y: usize| ((x * 13 + y * y * 7) % 256) as u8;
        let (width, height) = (43, 18);
        let luma = (0..width * height).map(|i| gray(i % width, i / width));
        let frame = GrayFrame::from_luma(width as u32, height as u32, luma.collect());
        let frame = frame.expect("a frame of this size");
        for downsample in [2, 4] {
            let found = picture(&frame, downsample, vec![9; 5]);
            let (columns, rows) = (width / downsample, height / downsample);
            assert_eq!(
                (found.width(), found.height()),
                (columns as u32, rows as u32)
            );
            assert_eq!(found.downsample(), downsample as f64);
            for (at, found) in found.pixels().iter().enumerate() {
                let (column, row) = (at % columns, at / columns);
                let square = (0..downsample * downsample).map(|i| {
                    let (x, y) = (
                        column * downsample + i % downsample,
                        row * downsample + i / downsample,
                    );
                    f64::from(gray(x, y))
                });
                let mean = square.sum::<f64>() / (downsample * downsample) as f64;
                assert!((f64::from(*found) - mean).abs() <= 0.5, "{found} {mean}");
            }
        }
    }

    #[test]
    fn cells_have_six_pixels_and_four_when_they_have_shrunk() {
        let params = Preset::Robust.params();
        // Boxes with eight cells along 1.2 of their sides.
        let of = |cell: f64, scale: f64| {
            let bounds = StateBounds {
                frame_width: 320.0,
                frame_height: 240.0,
                box_width: cell * 8.0 / 1.2,
                box_height: 2.0 * cell * 8.0 / 1.2,
            };
            let target = Particle {
                x: 160.0,
                y: 120.0,
                scale,
            };
            downsample(&target, &bounds, &params)
        };
        assert_eq!(
            [3.0, 11.9, 12.1, 23.9, 24.1, 50.0].map(|cell| of(cell, 1.0)),
            [1, 1, 2, 2, 4, 4]
        );
        assert_eq!(
            [2.0, 1.0, 0.67, 0.66].map(|scale| of(12.1, scale)),
            [2, 2, 2, 1]
        );
        let target = Particle {
            x: 1.0,
            y: 1.0,
            scale: 1.0,
        };
        let thin = StateBounds {
            frame_width: 300.0,
            frame_height: 3.0,
            box_width: 300.0,
            box_height: 300.0,
        };
        assert_eq!(downsample(&target, &thin, &params), 2);
        let gray = Params {
            features: Features::Gray,
            ..params
        };
        assert_eq!(downsample(&target, &thin, &gray), 1);
    }
}
