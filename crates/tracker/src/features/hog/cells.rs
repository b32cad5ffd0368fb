//! The cells of one area of a gradient histogram, and their normalisation.

use pulp::Simd;

use crate::features::hog::block_norm::BlockNorm;
use crate::features::hog::channels::{
    CHANNELS, CHROMA, GRAY, GRAY_WEIGHT, LANES, Lanes, registers,
};
use crate::features::hog::integral::IntegralChannels;
use crate::features::hog::sample_coords::SampleCoords;
use crate::image::rect::Rect;

/// The largest normalised value of a direction, so that one strong edge does not outweigh everything else.
pub(crate) const MAX_DIRECTION: f32 = 0.4;
/// Added to the mean energy as a gradient of this strength in every pixel, in gray levels: weaker ones are noise.
pub(crate) const MIN_STRENGTH: f32 = 2.0;
/// The smallest standard deviation of the gray values, in gray levels, that they are divided by.
pub(crate) const MIN_CONTRAST: f32 = 4.0;

/// The share of a channel in a cell's energy.
const ENERGY_SHARES: Lanes = Lanes::directions(1.0, 1.0);
/// The largest value of each channel.
const LIMITS: Lanes = {
    let mut limits = Lanes([MAX_DIRECTION; LANES]);
    limits.0[GRAY] = f32::INFINITY;
    limits.0[CHROMA[0]] = f32::INFINITY;
    limits.0[CHROMA[1]] = f32::INFINITY;
    limits
};

/// Columns of cells that are summed together: as many as an area usually has.
const STRIP: usize = 8;

/// The cells of one area; their memory is kept from one frame to the next.
#[derive(Debug, Clone, Default)]
pub(crate) struct HogCells {
    columns: usize,
    rows: usize,
    /// The channels of each cell, summed over its pixels, row by row. The integral image's mean gray is subtracted from
    /// every pixel, and pixels beyond its window are black.
    pub cells: Vec<Lanes>,
    norm: BlockNorm,
    /// The sum of the gray values of all cells, and that of their squares.
    gray_sum: f32,
    gray_squares: f32,
    /// The area of a cell, in pixels.
    cell_area: f32,
    /// The edges of the cells in the integral image.
    x_edges: SampleCoords,
    y_edges: SampleCoords,
    /// For an area that reaches out of the window: how many of its pixels each column of cells spans.
    widths_inside: Vec<f32>,
}

impl HogCells {
    /// Makes room for areas of up to `columns` x `rows` cells.
    pub fn reserve(&mut self, columns: usize, rows: usize) {
        if self.cells.capacity() < columns * rows {
            self.resize(columns, rows);
        }
    }

    /// Changes the numbers of columns and rows of cells.
    pub fn resize(&mut self, columns: usize, rows: usize) {
        if (self.columns, self.rows) == (columns, rows) {
            return;
        }
        (self.columns, self.rows) = (columns, rows);
        self.cells.resize(columns * rows, Lanes::ZERO);
        self.norm.resize(columns, rows);
        self.x_edges.resize(columns + 1);
        self.y_edges.resize(rows + 1);
        self.widths_inside.resize(columns, 0.0);
    }

    /// Sums the cells of `area`, and their energies.
    #[inline(always)]
    pub fn sum<S: Simd>(&mut self, simd: S, integral: &IntegralChannels, area: &Rect) {
        let (columns, rows) = (self.columns, self.rows);
        let width = (area.width / columns as f64) as f32;
        let height = (area.height / rows as f64) as f32;
        integral.x.locate(area.x as f32, width, &mut self.x_edges);
        integral.y.locate(area.y as f32, height, &mut self.y_edges);
        let mut totals = [Lanes::ZERO; 2];
        let mut first = 0;
        while first + STRIP <= columns {
            self.sum_strip::<S, STRIP>(simd, integral, first, &mut totals);
            first += STRIP;
        }
        while first < columns {
            self.sum_strip::<S, 1>(simd, integral, first, &mut totals);
            first += 1;
        }
        self.norm.sum_vertically();
        self.cell_area = (area.width * area.height) as f32 / self.cells.len() as f32;
        [self.gray_sum, self.gray_squares] = totals.map(|total| total.0[GRAY]);
        let is_inside =
            integral.x.contains(area.x, area.width) && integral.y.contains(area.y, area.height);
        if !is_inside {
            self.blacken_outside(integral);
        }
    }

    /// Makes the pixels beyond the window black. In the integral image they have the mean gray.
    #[cold]
    fn blacken_outside(&mut self, integral: &IntegralChannels) {
        (self.gray_sum, self.gray_squares) = (0.0, 0.0);
        let x = |edge: usize| integral.x.pixels_before(self.x_edges.get(edge));
        let y = |edge: usize| integral.y.pixels_before(self.y_edges.get(edge));
        for (column, width) in self.widths_inside.iter_mut().enumerate() {
            *width = x(column + 1) - x(column);
        }
        for (row, cells) in self.cells.chunks_exact_mut(self.columns).enumerate() {
            let height = y(row + 1) - y(row);
            for (cell, width) in cells.iter_mut().zip(&self.widths_inside) {
                let gray = &mut cell.0[GRAY];
                *gray -= integral.mean_gray * (self.cell_area - width * height);
                self.gray_sum += *gray;
                self.gray_squares += *gray * *gray;
            }
        }
    }

    /// Sums the cells of `N` columns from `first` on, and their energies. Adds the cells and their squares to `totals`.
    #[inline(always)]
    fn sum_strip<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        integral: &IntegralChannels,
        first: usize,
        totals: &mut [Lanes; 2],
    ) {
        let energy_shares = ENERGY_SHARES;
        let energy_shares = energy_shares.load::<S>();
        let zero = simd.splat_f32s(0.0);
        let (mut cells_sum, mut squares_sum) = ([zero; LANES], [zero; LANES]);
        let left_edge = self.x_edges.get(first);
        let mut right_edges = [left_edge; N];
        for (i, edge) in right_edges.iter_mut().enumerate() {
            *edge = self.x_edges.get(first + 1 + i);
        }
        // The sum over the pixels of each column of cells, from the window's top down to the last edge.
        let mut columns_above = [Lanes::ZERO; N];
        let row = integral.row(self.y_edges.get(0));
        let mut left = row.at(simd, left_edge);
        for i in 0..N {
            let right = row.at(simd, right_edges[i]);
            let above = columns_above[i].load_mut::<S>();
            for register in 0..registers::<S>() {
                above[register] = simd.sub_f32s(right[register], left[register]);
            }
            left = right;
        }
        for (j, cells) in self.cells.chunks_exact_mut(self.columns).enumerate() {
            let cells = &mut cells[first..][..N];
            let row = integral.row(self.y_edges.get(j + 1));
            let mut energies = [zero; N];
            let mut left = row.at(simd, left_edge);
            for i in 0..N {
                let right = row.at(simd, right_edges[i]);
                let above = columns_above[i].load_mut::<S>();
                let cell = cells[i].load_mut::<S>();
                for register in 0..registers::<S>() {
                    let column = simd.sub_f32s(right[register], left[register]);
                    let sum = simd.sub_f32s(column, above[register]);
                    (above[register], cell[register]) = (column, sum);
                    let square = simd.mul_f32s(sum, sum);
                    cells_sum[register] = simd.add_f32s(cells_sum[register], sum);
                    squares_sum[register] = simd.add_f32s(squares_sum[register], square);
                    energies[i] = simd.mul_add_e_f32s(square, energy_shares[register], energies[i]);
                }
                left = right;
            }
            self.norm.set_energies(simd, (first, j), energies);
        }
        for (total, sums) in totals.iter_mut().zip([cells_sum, squares_sum]) {
            let total = total.load_mut::<S>();
            for register in 0..registers::<S>() {
                total[register] = simd.add_f32s(total[register], sums[register]);
            }
        }
    }

    /// Writes the feature vector of the cells to `out`, their mean chroma times `chroma_weight`.
    #[inline(always)]
    pub fn normalize<S: Simd>(&mut self, simd: S, chroma_weight: f32, out: &mut [f32]) {
        let (count, cell_area) = (self.cells.len() as f32, self.cell_area);
        let mean = self.gray_sum / count;
        let variance = (self.gray_squares / count - mean * mean).max(0.0);
        let gray_scale = GRAY_WEIGHT / variance.sqrt().max(MIN_CONTRAST * cell_area);
        let floor = (MIN_STRENGTH * cell_area) * (MIN_STRENGTH * cell_area);
        // A value is min(cell * factor + offset, limit).
        let mut own_factors = Lanes::single(GRAY, gray_scale);
        for channel in CHROMA {
            own_factors.0[channel] = chroma_weight / cell_area;
        }
        let offsets = Lanes::single(GRAY, -mean * gray_scale);
        let (own_factors, offsets) = (own_factors.load::<S>(), offsets.load::<S>());
        let (directions, limits) = (ENERGY_SHARES, LIMITS);
        let (directions, limits) = (directions.load::<S>(), limits.load::<S>());
        let factors = self.norm.factors(floor);
        let mut first = 0;
        for (cells, factors) in self.cells.chunks_exact(self.columns).zip(factors) {
            for (cell, &factor) in cells.iter().zip(factors) {
                let (direction_factor, cell) = (simd.splat_f32s(factor), cell.load::<S>());
                let mut values = Lanes::ZERO;
                let registers = values.load_mut::<S>().iter_mut().take(registers::<S>());
                for (register, value) in registers.enumerate() {
                    let factor = simd.mul_add_e_f32s(
                        directions[register],
                        direction_factor,
                        own_factors[register],
                    );
                    let scaled = simd.mul_add_e_f32s(cell[register], factor, offsets[register]);
                    *value = simd.min_f32s(scaled, limits[register]);
                }
                // The lanes after the channels are overwritten by the next cell.
                let out = &mut out[first..];
                if let Some(out) = out.first_chunk_mut::<LANES>() {
                    *out = values.0;
                } else {
                    out.copy_from_slice(&values.0[..CHANNELS]);
                }
                first += CHANNELS;
            }
        }
    }
}
