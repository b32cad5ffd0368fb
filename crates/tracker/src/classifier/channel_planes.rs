//! A grid of cells with each channel in lines of its own, so that a vector register holds neighbouring windows.

use pulp::Simd;

use crate::features::extractor::Grid;
use crate::features::hog::channels::{CHANNELS, GRAY, LANES};

/// Cells that a dense search goes beyond the window on each side at most: a wider search would cost more than the rest
/// of a step.
pub(crate) const MAX_OFFSET: usize = 24;
/// The channels after those of a cell: energies of all channels but the gray values, gray values and their squares,
/// each summed over as many cells to the right as a window is wide.
const WIDE: usize = GRAY + 1;
const WIDE_COUNT: usize = 3;
const PLANES: usize = WIDE + WIDE_COUNT;

/// The lines of a grid, those of a row of cells one after the other.
#[derive(Debug, Default)]
pub(crate) struct ChannelPlanes {
    /// The distance of the beginnings of two lines, in values. A register may begin at any cell, so lines end with
    /// unused values.
    stride: usize,
    lines: Vec<f32>,
    /// The energies and squares of one row.
    energies: Vec<f32>,
    squares: Vec<f32>,
}

impl ChannelPlanes {
    /// Loads the cells of `grid`, for windows of so many columns and rows; makes room for the widest dense search.
    #[inline(always)]
    pub fn load(&mut self, grid: &Grid, (width, height): (usize, usize)) {
        let max_columns = width + 2 * MAX_OFFSET + LANES;
        let max = max_columns * (height + 2 * MAX_OFFSET) * PLANES;
        reserve(&mut self.lines, max);
        reserve(&mut self.energies, max_columns);
        reserve(&mut self.squares, max_columns);
        self.stride = grid.columns + LANES;
        let cells = grid.values.chunks_exact(grid.columns * CHANNELS);
        let rows = cells.zip(grid.grays.chunks_exact(grid.columns));
        let lines = self.lines.chunks_exact_mut(PLANES * self.stride);
        for ((cells, grays), lines) in rows.zip(lines) {
            let cells = cells.as_chunks::<CHANNELS>().0;
            let (squares, energies) = (&mut self.squares, &mut self.energies);
            energies[..grays.len()].fill(0.0);
            for (channel, line) in lines.chunks_exact_mut(self.stride).enumerate() {
                if channel == GRAY {
                    break;
                }
                for ((value, energy), cell) in line.iter_mut().zip(&mut *energies).zip(cells) {
                    *value = cell[channel];
                    *energy += cell[channel] * cell[channel];
                }
            }
            for (square, gray) in squares.iter_mut().zip(grays) {
                *square = gray * gray;
            }
            let (gray_line, wide) = lines[GRAY * self.stride..].split_at_mut(self.stride);
            gray_line[..grays.len()].copy_from_slice(grays);
            let summed = [&energies[..grays.len()], grays, &squares[..grays.len()]];
            for (line, values) in wide.chunks_exact_mut(self.stride).zip(summed) {
                let line = &mut line[..grays.len() + 1 - width];
                line.fill(0.0);
                for right in 0..width {
                    for (sum, value) in line.iter_mut().zip(&values[right..]) {
                        *sum += value;
                    }
                }
            }
        }
    }

    /// The cells from column `first` on of row `row`, in channel `channel`.
    #[inline(always)]
    pub fn line(&self, (first, row): (usize, usize), channel: usize) -> &[f32] {
        &self.lines[(row * PLANES + channel) * self.stride + first..][..self.stride - first]
    }

    /// For the windows of `height` rows from (`first`, `row`) on, a lane each, the sums of the energies of the
    /// directions, of the gray values and of their squares.
    #[inline(always)]
    pub fn boxes<S: Simd>(
        &self,
        simd: S,
        (first, row): (usize, usize),
        height: usize,
    ) -> [S::f32s; WIDE_COUNT] {
        let mut sums = [simd.splat_f32s(0.0); WIDE_COUNT];
        for row in row..row + height {
            for (channel, sum) in (WIDE..).zip(&mut sums) {
                *sum = simd.add_f32s(*sum, load::<S>(self.line((first, row), channel)));
            }
        }
        sums
    }
}

/// Makes `values` at least `count` long.
fn reserve(values: &mut Vec<f32>, count: usize) {
    if values.len() < count {
        values.resize(count, 0.0);
    }
}

/// The first values as a register.
#[inline(always)]
pub(crate) fn load<S: Simd>(values: &[f32]) -> S::f32s {
    S::as_simd_f32s(&values[..S::F32_LANES]).0[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_the_channels_of_the_cells_and_boxes_their_sums() {
        let (columns, rows, width, height) = (11, 9, 5, 4);
        let number = |i: usize| ((i * i * 37 + i * 7919) % 100) as f32 / 10.0;
        let grid = Grid {
            columns,
            values: (0..columns * rows * CHANNELS).map(number).collect(),
            grays: (0..columns * rows).map(number).collect(),
        };
        let mut planes = ChannelPlanes::default();
        planes.load(&grid, (width, height));
        let cell = |i: usize, j: usize| &grid.values[(j * columns + i) * CHANNELS..][..GRAY];
        let gray = |i: usize, j: usize| grid.grays[j * columns + i];
        for (i, j) in [(0, 0), (3, 2), (6, 5)] {
            assert_eq!(planes.line((i, j), 4)[0], cell(i, j)[4]);
            assert_eq!(planes.line((i, j), GRAY)[0], gray(i, j));
            let sum = |of: &dyn Fn(usize, usize) -> f32| -> f32 {
                let places = (0..width * height).map(|at| (i + at % width, j + at / width));
                places.map(|(i, j)| of(i, j)).sum()
            };
            let energy = |i, j| cell(i, j).iter().map(|value| value * value).sum();
            let expected = [
                sum(&energy),
                sum(&gray),
                sum(&|i, j| gray(i, j) * gray(i, j)),
            ];
            let found = planes.boxes(pulp::Scalar, (i, j), height);
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4 * expected);
            }
        }
    }
}
