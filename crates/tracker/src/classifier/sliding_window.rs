//! The discriminant's scores of all windows of a grid of cells.
//!
//! The products of a window's cells with the weights are a correlation on the grid; what the window's own mean,
//! deviation and length change follows from sums ([`Scorer`]). Windows side by side are worked on together, one a lane,
//! so each channel of the grid is brought into a line of its own first ([`ChannelPlanes`]).

use pulp::{Arch, Simd};

use crate::classifier::channel_planes::{ChannelPlanes, load};
use crate::classifier::ridge::Discriminant;
use crate::classifier::window_score::Scorer;
use crate::features::extractor::Grid;
use crate::features::hog::channels::{CHANNELS, GRAY, Lanes};

/// Rows of windows whose sums are in registers at a time.
const ROWS: usize = 4;

/// Writes the score of each window of `grid`, row by row, to `out`; `cell_pixels` is the area of a cell in working
/// pixels.
#[pulp::with_simd(window_scores = Arch::new())]
#[inline(always)]
pub(crate) fn window_scores_simd<S: Simd>(
    simd: S,
    planes: &mut ChannelPlanes,
    grid: &Grid,
    discriminant: &Discriminant,
    (width, height): (usize, usize),
    cell_pixels: f32,
    out: &mut [f32],
) {
    planes.load(grid, (width, height));
    let scorer = Scorer::new(discriminant, cell_pixels);
    let columns = grid.columns + 1 - width;
    let last = out.len() / columns - 1;
    for (block, rows) in out.chunks_mut(ROWS * columns).enumerate() {
        // A block at the end has the last row more than once.
        let mut places = [last; ROWS];
        for (row, place) in places.iter_mut().enumerate() {
            *place = last.min(block * ROWS + row);
        }
        for first in (0..columns).step_by(S::F32_LANES) {
            let products = correlate(simd, planes, (first, places), width, discriminant);
            let [directions, grays] = products;
            let products = directions.into_iter().zip(grays);
            let rows = rows.chunks_mut(columns).zip(places).zip(products);
            for ((row, j), (directions, grays)) in rows {
                let boxes = planes.boxes(simd, (first, j), height);
                let mut scores = Lanes::ZERO;
                scores.load_mut::<S>()[0] = scorer.score(simd, [directions, grays], boxes);
                for (out, score) in row[first..].iter_mut().zip(&scores.0[..S::F32_LANES]) {
                    *out = *score;
                }
            }
        }
    }
}

/// The products of the windows from column `first` on in each of `rows`: with the weights and with the origin, of all
/// channels but the gray one and then of the gray one. The products of windows that reach beyond the grid mean nothing.
#[inline(always)]
fn correlate<S: Simd>(
    simd: S,
    planes: &ChannelPlanes,
    (first, rows): (usize, [usize; ROWS]),
    width: usize,
    discriminant: &Discriminant,
) -> [[[S::f32s; 2]; ROWS]; 2] {
    let row_len = width * CHANNELS;
    let weights = discriminant.weights.chunks_exact(row_len);
    let origin = discriminant.origin.chunks_exact(row_len);
    let mut sums = [[[simd.splat_f32s(0.0); 2]; ROWS]; 2];
    for (r, of) in weights.zip(origin).enumerate() {
        for channel in 0..CHANNELS {
            let mut lines = [&[][..]; ROWS];
            for (line, row) in lines.iter_mut().zip(rows) {
                *line = planes.line((first, row + r), channel);
            }
            let sums = &mut sums[usize::from(channel == GRAY)];
            add_products(simd, lines, of, channel, sums);
        }
    }
    sums
}

/// Adds the products of a channel of a row of cells, for windows from the beginning of each of `lines` on.
#[inline(always)]
fn add_products<S: Simd>(
    simd: S,
    lines: [&[f32]; ROWS],
    (weights, origin): (&[f32], &[f32]),
    channel: usize,
    sums: &mut [[S::f32s; 2]; ROWS],
) {
    let weights = weights.as_chunks::<CHANNELS>().0;
    let origin = origin.as_chunks::<CHANNELS>().0;
    for (c, (weights, origin)) in weights.iter().zip(origin).enumerate() {
        let weight = simd.splat_f32s(weights[channel]);
        let origin = simd.splat_f32s(origin[channel]);
        for row in 0..ROWS {
            let values = load::<S>(&lines[row][c..]);
            sums[row][0] = simd.mul_add_e_f32s(values, weight, sums[row][0]);
            sums[row][1] = simd.mul_add_e_f32s(values, origin, sums[row][1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classifier::channel_planes::MAX_OFFSET;
    use crate::features::extractor::Extractor;
    use crate::features::hog::cells::MIN_CONTRAST;
    use crate::features::hog::channels::GRAY_WEIGHT;
    use crate::image::frame::Frame;
    use crate::linalg::vector_ops;
    use crate::motion::particles::{Particle, StateBounds};
    use crate::params::presets::Preset;
    use crate::params::table::Params;

    fn number(i: usize) -> f32 {
        ((i * i * 37 + i * 7919) % 1000) as f32 / 500.0 - 1.0
    }

    fn frame() -> Frame {
        let luma = (0..160 * 120).map(|i| ((i * i / 7 + i / 160 * 13 + i) % 251) as u8);
        Frame::from_luma(160, 120, luma.collect()).expect("a frame of this size")
    }

    /// Each score from the vector of its window, written out.
    #[test]
    #[expect(clippy::too_many_lines, reason = "one definition, written out")]
    fn scores_are_those_of_the_unit_vectors_of_windows() {
        for (width, height) in [(8, 8), (5, 7)] {
            let params = Params {
                patch_width: width,
                patch_height: height,
                ..Preset::Robust.params()
            };
            let len = params.feature_len();
            let bounds = StateBounds {
                frame_width: 160.0,
                frame_height: 120.0,
                box_width: 30.0,
                box_height: 24.0,
            };
            let center = Particle {
                x: 70.0,
                y: 55.0,
                scale: 1.1,
            };
            let mut extractor = Extractor::default();
            extractor.compute_channels(&frame(), &[center], 60.0, &bounds, &params);
            let origin: Vec<f32> = (0..len).map(|i| number(i) / 20.0).collect();
            let mut discriminant = Discriminant::new(origin);
            let weights: Vec<f32> = (0..len).map(|i| number(i + 5000)).collect();
            discriminant.weights.clone_from(&weights);

            let (across, down) = (5, 3);
            let mut grid = Grid::default();
            extractor.grid(
                &center,
                (across, down),
                MAX_OFFSET,
                &bounds,
                &params,
                &mut grid,
            );
            let mut scores = vec![0.0; (2 * across + 1) * (2 * down + 1)];
            let (cell_width, cell_height) = Extractor::cell_size(&center, &bounds, &params);
            let cell_pixels = (cell_width * cell_height) as f32;
            window_scores(
                &mut ChannelPlanes::default(),
                &grid,
                &discriminant,
                (width as usize, height as usize),
                cell_pixels,
                &mut scores,
            );

            let (width, height) = (width as usize, height as usize);
            for (index, score) in scores.iter().enumerate() {
                let (i, j) = (index % (2 * across + 1), index / (2 * across + 1));
                let cell = |c: usize| (j + c / width) * grid.columns + i + c % width;
                let grays: Vec<f32> = (0..width * height).map(|c| grid.grays[cell(c)]).collect();
                let count = grays.len() as f32;
                let mean = grays.iter().sum::<f32>() / count;
                let variance = grays.iter().map(|gray| (gray - mean).powi(2)).sum::<f32>() / count;
                let deviation = variance.sqrt().max(MIN_CONTRAST * cell_pixels);
                let mut vector = Vec::new();
                for (c, gray) in grays.iter().enumerate() {
                    let values = &grid.values[cell(c) * CHANNELS..][..GRAY];
                    vector.extend_from_slice(values);
                    vector.push((gray - mean) / deviation * GRAY_WEIGHT);
                }
                let left = vector
                    .iter()
                    .zip(&discriminant.origin)
                    .map(|(value, origin)| value - origin);
                let left: Vec<f32> = left.collect();
                let length = vector_ops::dot(&left, &left).sqrt();
                let expected = vector_ops::dot(&left, &weights) / length;
                assert!(
                    (score - expected).abs() < 1e-3,
                    "{index}: {score} {expected}"
                );
            }
        }
    }
}
