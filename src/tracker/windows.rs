//! The discriminant's scores of all windows of a grid of cells.
//!
//! A window's directions are as they are on the grid, so their products with the weights are a correlation. Its gray
//! values have its own mean taken off and are divided by its own deviation; both follow from sums, as does the length
//! that the discriminant divides by ([`examples`](super::examples)).

use pulp::{Arch, Simd, WithSimd};

use super::cells::{CHANNELS, LEAST_CONTRAST};
use super::discriminant::Discriminant;
use super::gradients::DIRECTIONS;
use super::view::Grid;
use super::{Params, comparison, matrix, scan};

/// Windows whose sums are in registers at a time.
const GROUP: usize = 4;
/// What is left of a squared length below this share of it is rounding, as for examples.
const LEAST_LEFT: f32 = 1e-6;

/// Room for the scores of a grid.
#[derive(Debug, Default)]
pub(super) struct Windows {
    /// The energies of the cells' directions.
    energies: Vec<f32>,
    sums: Sums,
}

/// For each window of a row a sum over its cells.
#[derive(Debug, Default)]
struct Sums {
    energies: Vec<f32>,
    grays: Vec<f32>,
    squares: Vec<f32>,
    of_weights: Vec<f32>,
    of_origin: Vec<f32>,
}

/// [`Windows::scores`], to be compiled for the instructions that this machine has.
struct Scores<'a> {
    windows: &'a mut Windows,
    grid: &'a Grid,
    discriminant: &'a Discriminant,
    params: &'a Params,
    cell_pixels: f32,
    out: &'a mut [f32],
}

impl WithSimd for Scores<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            windows: Windows { energies, sums },
            grid,
            discriminant,
            params,
            cell_pixels,
            out,
        } = self;
        let (width, height) = (params.patch_width as usize, params.patch_height as usize);
        let columns = grid.columns + 1 - width;
        comparison::empty(energies, grid.grays.capacity());
        energies.extend(grid.values.as_chunks::<CHANNELS>().0.iter().map(|cell| {
            let directions = cell[..DIRECTIONS].iter();
            directions.map(|value| value * value).sum::<f32>()
        }));
        let (weights, origin) = (discriminant.weights(), discriminant.origin());
        let grays = |vector: &[f32]| -> f32 {
            let cells = vector.as_chunks::<CHANNELS>().0.iter();
            cells.map(|cell| cell[DIRECTIONS]).sum()
        };
        let (gray_weights, gray_origin) = (grays(weights), grays(origin));
        let origin_score = matrix::dot(weights, origin);
        let origin_square = matrix::dot(origin, origin);
        let count = (width * height) as f32;
        let least_deviation = LEAST_CONTRAST * cell_pixels;
        for (j, row) in out.chunks_exact_mut(columns).enumerate() {
            sums.take(grid, energies, j, (width, height), weights, origin);
            for first in (0..columns).step_by(GROUP) {
                let windows = correlate(simd, grid, (first, j), height, weights, origin);
                for (i, window) in (first..columns).zip(windows) {
                    // The gray values of an area have its own mean and deviation.
                    let mean = sums.grays[i] / count;
                    let variance = (sums.squares[i] / count - mean * mean).max(0.0);
                    let scale = params.gray_weight as f32 / variance.sqrt().max(least_deviation);
                    let of_weights = window[0] + scale * (sums.of_weights[i] - mean * gray_weights);
                    let of_origin = window[1] + scale * (sums.of_origin[i] - mean * gray_origin);
                    let square = sums.energies[i] + scale * scale * variance * count;
                    let left = square + origin_square - 2.0 * of_origin;
                    let is_left = left > (square + origin_square) * LEAST_LEFT;
                    row[i] = if is_left {
                        (of_weights - origin_score) / left.sqrt()
                    } else {
                        0.0
                    };
                }
            }
        }
    }
}

impl Windows {
    /// Writes the score of each window of `grid`, row by row, to `out`; `cell_pixels` is the area of a cell in working
    /// pixels.
    pub fn scores(
        &mut self,
        grid: &Grid,
        discriminant: &Discriminant,
        params: &Params,
        cell_pixels: f32,
        out: &mut [f32],
    ) {
        Arch::new().dispatch(Scores {
            windows: self,
            grid,
            discriminant,
            params,
            cell_pixels,
            out,
        });
    }
}

/// The products of the directions of [`GROUP`] windows, the first at (`i`, `j`), with the weights and the origin. Of
/// windows that are not on the grid they mean nothing.
#[inline(always)]
fn correlate<S: Simd>(
    simd: S,
    grid: &Grid,
    (i, j): (usize, usize),
    height: usize,
    weights: &[f32],
    origin: &[f32],
) -> [[f32; 2]; GROUP] {
    let stride = grid.columns * CHANNELS;
    let row_len = weights.len() / height;
    let most = stride - row_len;
    let mut registers = [[simd.splat_f32s(0.0); 2]; GROUP];
    let mut rests = [[0.0; 2]; GROUP];
    for r in 0..height {
        let cells = &grid.values[(j + r) * stride..][..stride];
        let (weights, weights_rest) = S::as_simd_f32s(&weights[r * row_len..][..row_len]);
        let (origin, origin_rest) = S::as_simd_f32s(&origin[r * row_len..][..row_len]);
        for (window, (sums, rests)) in registers.iter_mut().zip(&mut rests).enumerate() {
            let first = ((i + window) * CHANNELS).min(most);
            let (cells, cells_rest) = S::as_simd_f32s(&cells[first..][..row_len]);
            for ((&cell, &weight), &origin) in cells.iter().zip(weights).zip(origin) {
                sums[0] = simd.mul_add_f32s(cell, weight, sums[0]);
                sums[1] = simd.mul_add_f32s(cell, origin, sums[1]);
            }
            let shared = cells_rest.iter().zip(weights_rest).zip(origin_rest);
            for ((cell, weight), origin) in shared {
                rests[0] += cell * weight;
                rests[1] += cell * origin;
            }
        }
    }
    let mut sums = rests;
    for (sums, registers) in sums.iter_mut().zip(registers) {
        for (sum, register) in sums.iter_mut().zip(registers) {
            *sum += simd.reduce_sum_f32s(register);
        }
    }
    sums
}

impl Sums {
    /// Sums up the windows of row `j` of `grid`, `width` x `height` cells each.
    #[inline(always)]
    fn take(
        &mut self,
        grid: &Grid,
        energies: &[f32],
        j: usize,
        (width, height): (usize, usize),
        weights: &[f32],
        origin: &[f32],
    ) {
        let columns = grid.columns + 1 - width;
        for sums in [
            &mut self.energies,
            &mut self.grays,
            &mut self.squares,
            &mut self.of_weights,
            &mut self.of_origin,
        ] {
            comparison::empty(sums, 2 * scan::MOST_AWAY + 1);
            sums.resize(columns, 0.0);
        }
        for r in 0..height {
            for c in 0..width {
                let gray = (r * width + c) * CHANNELS + DIRECTIONS;
                let (weight, origin) = (weights[gray], origin[gray]);
                let at = (j + r) * grid.columns + c;
                let cells = grid.grays[at..][..columns].iter();
                let cells = cells.zip(&energies[at..][..columns]);
                let sums = self.energies[..columns].iter_mut();
                let sums = sums.zip(&mut self.grays[..columns]);
                let sums = sums.zip(&mut self.squares[..columns]);
                let sums = sums.zip(&mut self.of_weights[..columns]);
                let sums = sums.zip(&mut self.of_origin[..columns]);
                for (((((energy, gray), square), of_weight), of_origin), (value, more)) in
                    sums.zip(cells)
                {
                    *energy += more;
                    *gray += value;
                    *square += value * value;
                    *of_weight += weight * value;
                    *of_origin += origin * value;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::motion::{Particle, Reach};
    use crate::tracker::view::View;
    use crate::tracker::{GrayFrame, Preset};

    fn number(i: usize) -> f32 {
        ((i * i * 37 + i * 7919) % 1000) as f32 / 500.0 - 1.0
    }

    fn frame() -> GrayFrame {
        let luma = (0..160 * 120).map(|i| ((i * i / 7 + i / 160 * 13 + i) % 251) as u8);
        GrayFrame::from_luma(160, 120, luma.collect()).expect("a frame of this size")
    }

    /// Each score from the vector of its window, written out.
    #[test]
    fn scores_are_those_of_the_unit_vectors_of_windows() {
        for (width, height) in [(8, 8), (5, 7)] {
            let params = Params {
                patch_width: width,
                patch_height: height,
                ..Preset::Robust.params()
            };
            let len = params.feature_len();
            let reach = Reach {
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
            let mut view = View::default();
            view.open(&frame(), &[center], 60.0, &reach, &params);
            let origin: Vec<f32> = (0..len).map(|i| number(i) / 20.0).collect();
            let mut discriminant = Discriminant::new(origin.clone());
            let weights: Vec<f32> = (0..len).map(|i| number(i + 5000)).collect();
            discriminant.set_weights(&weights);

            let (across, down) = (5, 3);
            let mut grid = Grid::default();
            view.grid(
                &center,
                (across, down),
                scan::MOST_AWAY,
                &reach,
                &params,
                &mut grid,
            );
            let mut scores = vec![0.0; (2 * across + 1) * (2 * down + 1)];
            let (cell_width, cell_height) = View::cell(&center, &reach, &params);
            let cell_pixels = (cell_width * cell_height) as f32;
            Windows::default().scores(&grid, &discriminant, &params, cell_pixels, &mut scores);

            let (width, height) = (width as usize, height as usize);
            for (index, score) in scores.iter().enumerate() {
                let (i, j) = (index % (2 * across + 1), index / (2 * across + 1));
                let cell = |c: usize| (j + c / width) * grid.columns + i + c % width;
                let grays: Vec<f32> = (0..width * height).map(|c| grid.grays[cell(c)]).collect();
                let count = grays.len() as f32;
                let mean = grays.iter().sum::<f32>() / count;
                let variance = grays.iter().map(|gray| (gray - mean).powi(2)).sum::<f32>() / count;
                let deviation = variance.sqrt().max(LEAST_CONTRAST * cell_pixels);
                let mut vector = Vec::new();
                for (c, gray) in grays.iter().enumerate() {
                    let values = &grid.values[cell(c) * CHANNELS..][..DIRECTIONS];
                    vector.extend_from_slice(values);
                    vector.push((gray - mean) / deviation * params.gray_weight as f32);
                }
                let left = vector
                    .iter()
                    .zip(&origin)
                    .map(|(value, origin)| value - origin);
                let left: Vec<f32> = left.collect();
                let length = matrix::dot(&left, &left).sqrt();
                let expected = matrix::dot(&left, &weights) / length;
                assert!(
                    (score - expected).abs() < 1e-3,
                    "{index}: {score} {expected}"
                );
            }
        }
    }
}
