//! Histograms of gradient directions: the cells of one area, and its feature vector.

use pulp::Simd;

use crate::tracker::features::block_norm::BlockNorm;
use crate::tracker::features::hog::CHANNELS;
use crate::tracker::features::integral::{
    DIRECTIONS, GRAY, IntegralChannels, LANES, Lanes, registers,
};
use crate::tracker::features::sample_coords::SampleCoords;
use crate::tracker::image::rect::Rect;

/// The greatest normalised value of a direction, so that one strong edge does not outweigh all else.
pub(crate) const GREATEST: f32 = 0.4;
/// Gradients of flat cells are noise: this much, in gray levels a pixel, is added to what they are divided by.
pub(crate) const FLAT: f32 = 2.0;
/// The least standard deviation of gray values, in gray levels, that theirs are divided by.
pub(crate) const MIN_CONTRAST: f32 = 4.0;

/// The share of each channel in a cell's energy.
const ENERGY_SHARES: Lanes = {
    let mut shares = Lanes::ZERO;
    let mut lane = 0;
    while lane < DIRECTIONS {
        shares.0[lane] = 1.0;
        lane += 1;
    }
    shares
};
/// The greatest value of each channel.
const LIMITS: Lanes = {
    let mut limits = Lanes([GREATEST; LANES]);
    limits.0[GRAY] = f32::INFINITY;
    limits
};

/// Columns of cells that are worked on together: as many as a usual area has.
const STRIP: usize = 8;

/// The cells of one area.
#[derive(Debug, Clone, Default)]
pub(crate) struct Area {
    /// The channels of each cell, row by row.
    pub cells: Vec<Lanes>,
    energies: BlockNorm,
    grays: Grays,
    /// The mean number of pixels of a cell.
    pixels: f32,
    /// The corners of the cells among the columns and the rows of the sums.
    places: [SampleCoords; 2],
}

/// The sum of the gray values of all cells, and that of their squares.
#[derive(Debug, Clone, Copy, Default)]
struct Grays {
    sum: f32,
    squares: f32,
}

impl Area {
    /// Makes room for so many columns and rows of cells.
    pub fn prepare(&mut self, columns: usize, rows: usize) {
        self.cells.resize(columns * rows, Lanes::ZERO);
        self.energies.prepare(columns, rows);
        self.places[0].prepare(columns + 1);
        self.places[1].prepare(rows + 1);
    }

    /// Takes the places of the cells of `area`, for [`sum_up`](Self::sum_up).
    #[inline(always)]
    pub fn locate(
        &mut self,
        sums: &IntegralChannels,
        area: &Rect,
        (columns, rows): (usize, usize),
    ) {
        let width = (area.width / columns as f64) as f32;
        let height = (area.height / rows as f64) as f32;
        sums.columns((area.x as f32, width), &mut self.places[0]);
        sums.rows((area.y as f32, height), &mut self.places[1]);
    }

    /// Becomes the cells of the area that was located, and their energies.
    #[inline(always)]
    pub fn sum_up<S: Simd>(
        &mut self,
        simd: S,
        sums: &IntegralChannels,
        area: &Rect,
        columns: usize,
    ) {
        let mut grays = [Lanes::ZERO; 2];
        let mut first = 0;
        while first + STRIP <= columns {
            self.sum_strip::<S, STRIP>(simd, sums, (first, columns), &mut grays);
            first += STRIP;
        }
        while first < columns {
            self.sum_strip::<S, 1>(simd, sums, (first, columns), &mut grays);
            first += 1;
        }
        self.energies.sum_columns();
        self.grays = Grays {
            sum: grays[0].0[GRAY],
            squares: grays[1].0[GRAY],
        };
        self.pixels = (area.width * area.height) as f32 / self.cells.len() as f32;
    }

    /// The cells of `N` columns from `first` on, each the sum at its lower right corner, less those at the two beside it,
    /// and that at its upper left one; and their energies. Adds the cells and their squares to `total`.
    #[inline(always)]
    fn sum_strip<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        sums: &IntegralChannels,
        (first, columns): (usize, usize),
        total: &mut [Lanes; 2],
    ) {
        let energy_shares = ENERGY_SHARES;
        let energy_shares = energy_shares.load::<S>();
        let zero = simd.splat_f32s(0.0);
        let (mut cells_sum, mut squares_sum) = ([zero; LANES], [zero; LANES]);
        let [column_places, row_places] = &self.places;
        let mut places = [column_places.get(first); N];
        for (i, place) in places.iter_mut().enumerate() {
            *place = column_places.get(first + 1 + i);
        }
        let first_place = column_places.get(first);
        // For each column the sum at its right corner less that at its left one, in the last row of corners. The first row
        // makes no cells.
        let mut edges = [[zero; LANES]; N];
        let row = sums.row(row_places.get(0));
        let mut left = row.at(simd, first_place);
        for i in 0..N {
            let right = row.at(simd, places[i]);
            for register in 0..registers::<S>() {
                edges[i][register] = simd.sub_f32s(right[register], left[register]);
            }
            left = right;
        }
        for (j, cells) in self.cells.chunks_exact_mut(columns).enumerate() {
            let cells = &mut cells[first..][..N];
            let row = sums.row(row_places.get(j + 1));
            let mut energies = [zero; N];
            let mut left = row.at(simd, first_place);
            for i in 0..N {
                let right = row.at(simd, places[i]);
                let cell = cells[i].load_mut::<S>();
                for register in 0..registers::<S>() {
                    let across = simd.sub_f32s(right[register], left[register]);
                    let inside = simd.sub_f32s(across, edges[i][register]);
                    (edges[i][register], cell[register]) = (across, inside);
                    let square = simd.mul_f32s(inside, inside);
                    cells_sum[register] = simd.add_f32s(cells_sum[register], inside);
                    squares_sum[register] = simd.add_f32s(squares_sum[register], square);
                    energies[i] = simd.mul_add_e_f32s(square, energy_shares[register], energies[i]);
                }
                left = right;
            }
            self.energies.take(simd, (first, j), energies);
        }
        for (total, sums) in total.iter_mut().zip([cells_sum, squares_sum]) {
            let total = total.load_mut::<S>();
            for register in 0..registers::<S>() {
                total[register] = simd.add_f32s(total[register], sums[register]);
            }
        }
    }

    /// Writes the feature vector of the cells to `out`, if there is room.
    #[inline(always)]
    pub fn normalize<S: Simd>(
        &mut self,
        simd: S,
        columns: usize,
        gray_weight: f32,
        out: &mut [f32],
    ) {
        if out.is_empty() {
            return;
        }
        let (count, pixels, grays) = (self.cells.len() as f32, self.pixels, self.grays);
        let mean = grays.sum / count;
        let variance = (grays.squares / count - mean * mean).max(0.0);
        let gray_scale = gray_weight / variance.sqrt().max(MIN_CONTRAST * pixels);
        let floor = (FLAT * pixels) * (FLAT * pixels);
        // A value is min(cell * factor + offset, limit).
        let (mut gray_factors, mut offsets) = (Lanes::ZERO, Lanes::ZERO);
        (gray_factors.0[GRAY], offsets.0[GRAY]) = (gray_scale, -mean * gray_scale);
        let (gray_factors, offsets) = (gray_factors.load::<S>(), offsets.load::<S>());
        let (directions, limits) = (ENERGY_SHARES, LIMITS);
        let (directions, limits) = (directions.load::<S>(), limits.load::<S>());
        let scales = self.energies.scales(floor);
        let mut first = 0;
        for (cells, scales) in self.cells.chunks_exact(columns).zip(scales) {
            for (cell, &scale) in cells.iter().zip(scales) {
                let (scale, cell) = (simd.splat_f32s(scale), cell.load::<S>());
                let mut values = Lanes::ZERO;
                for (register, value) in values.load_mut::<S>().iter_mut().enumerate() {
                    let factor =
                        simd.mul_add_e_f32s(directions[register], scale, gray_factors[register]);
                    let scaled = simd.mul_add_e_f32s(cell[register], factor, offsets[register]);
                    *value = simd.min_f32s(scaled, limits[register]);
                }
                // What is beyond the channels is written over by the next cell.
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
