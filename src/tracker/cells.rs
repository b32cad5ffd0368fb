//! Histograms of gradient directions: the feature vector of an area, from the sums over its cells.

use pulp::{Arch, Simd, WithSimd};

use super::energies::Energies;
use super::gradients::{DIRECTIONS, GRAY, GradientSums, LANES, Lanes, registers};
use super::places::Places;
use super::{Params, Rect};

/// Values of a cell: the directions, then its gray value.
pub(super) const CHANNELS: usize = DIRECTIONS + 1;

/// The greatest normalised value of a direction, so that one strong edge does not outweigh all else.
const GREATEST: f32 = 0.4;
/// Gradients of flat cells are noise: this much, in gray levels a pixel, is added to what they are divided by.
const FLAT: f32 = 2.0;
/// The least standard deviation of gray values, in gray levels, that theirs are divided by.
pub(super) const LEAST_CONTRAST: f32 = 4.0;

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

/// Room for the cells of areas.
#[derive(Debug, Clone, Default)]
pub(super) struct Cells {
    columns: usize,
    rows: usize,
    /// The corners of the cells among the columns and the rows of the sums.
    places: [Places; 2],
    /// Of two areas, so that the one is summed up while the other is still divided.
    areas: [Area; 2],
}

/// The cells of one area.
#[derive(Debug, Clone, Default)]
struct Area {
    /// The channels of each cell, row by row.
    cells: Vec<Lanes>,
    energies: Energies,
    grays: Grays,
    /// The mean number of pixels of a cell.
    pixels: f32,
}

/// [`Cells::describe`], to be compiled for the instructions that this machine has.
struct Describe<'a, A> {
    cells: &'a mut Cells,
    sums: &'a GradientSums,
    areas: A,
    gray_weight: f32,
    out: &'a mut [f32],
}

impl<A: Iterator<Item = Rect>> WithSimd for Describe<'_, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Cells {
            columns,
            rows,
            places,
            areas: [now, before],
        } = self.cells;
        let size = (*columns, *rows);
        let (mut now, mut before) = (now, before);
        let len = size.0 * size.1 * CHANNELS;
        let mut last = &mut [][..];
        for (area, out) in self.areas.zip(self.out.chunks_exact_mut(len)) {
            now.sum_up(simd, self.sums, &area, size, places);
            // Of the area before: what it reads was written long enough ago to have come to the cache.
            before.normalize(simd, size.0, self.gray_weight, last);
            last = out;
            (now, before) = (before, now);
        }
        before.normalize(simd, size.0, self.gray_weight, last);
    }
}

/// The sum of the gray values of all cells, and that of their squares.
#[derive(Debug, Clone, Copy, Default)]
struct Grays {
    sum: f32,
    squares: f32,
}

impl Cells {
    /// Writes the feature vectors of `areas` (working pixels, sides above 0, in the window that was summed up) to `out`,
    /// each of length D: cell by cell, row by row, the nine directions and the gray value.
    ///
    /// Each cell's directions are divided by the root of the mean energy of the 3 x 3 cells around it and clipped.
    /// Gray values have the area's mean taken off and are divided by its standard deviation.
    pub fn describe(
        &mut self,
        sums: &GradientSums,
        areas: impl Iterator<Item = Rect>,
        params: &Params,
        out: &mut [f32],
    ) {
        self.prepare(params.patch_width as usize, params.patch_height as usize);
        Arch::new().dispatch(Describe {
            cells: self,
            sums,
            areas,
            gray_weight: params.gray_weight as f32,
            out,
        });
    }

    /// The gray values of the cells of an area that was described alone, summed over their pixels.
    pub fn grays(&self) -> impl Iterator<Item = f32> {
        self.areas[0].cells.iter().map(|cell| cell.0[GRAY])
    }

    /// Makes room for up to so many columns and rows of cells, for areas of different numbers of them.
    pub fn reserve(&mut self, columns: usize, rows: usize) {
        if self.areas[0].cells.capacity() < columns * rows {
            self.prepare(columns, rows);
        }
    }

    /// Makes room for so many columns and rows of cells.
    fn prepare(&mut self, columns: usize, rows: usize) {
        if (self.columns, self.rows) == (columns, rows) {
            return;
        }
        (self.columns, self.rows) = (columns, rows);
        self.places[0].prepare(columns + 1);
        self.places[1].prepare(rows + 1);
        for area in &mut self.areas {
            area.cells.resize(columns * rows, Lanes::ZERO);
            area.energies.prepare(columns, rows);
        }
    }
}

impl Area {
    /// Becomes the cells of `area`, and their energies.
    #[inline(always)]
    fn sum_up<S: Simd>(
        &mut self,
        simd: S,
        sums: &GradientSums,
        area: &Rect,
        (columns, rows): (usize, usize),
        places: &mut [Places; 2],
    ) {
        let width = (area.width / columns as f64) as f32;
        let height = (area.height / rows as f64) as f32;
        sums.columns((area.x as f32, width), &mut places[0]);
        sums.rows((area.y as f32, height), &mut places[1]);
        let mut grays = [Lanes::ZERO; 2];
        let mut first = 0;
        while first + STRIP <= columns {
            self.sum_strip::<S, STRIP>(simd, sums, places, (first, columns), &mut grays);
            first += STRIP;
        }
        while first < columns {
            self.sum_strip::<S, 1>(simd, sums, places, (first, columns), &mut grays);
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
        sums: &GradientSums,
        places: &[Places; 2],
        (first, columns): (usize, usize),
        total: &mut [Lanes; 2],
    ) {
        let energy_shares = ENERGY_SHARES;
        let energy_shares = energy_shares.load::<S>();
        let zero = simd.splat_f32s(0.0);
        let (mut cells_sum, mut squares_sum) = ([zero; LANES], [zero; LANES]);
        let [column_places, row_places] = places;
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
    fn normalize<S: Simd>(&mut self, simd: S, columns: usize, gray_weight: f32, out: &mut [f32]) {
        if out.is_empty() {
            return;
        }
        let (count, pixels, grays) = (self.cells.len() as f32, self.pixels, self.grays);
        let mean = grays.sum / count;
        let variance = (grays.squares / count - mean * mean).max(0.0);
        let gray_scale = gray_weight / variance.sqrt().max(LEAST_CONTRAST * pixels);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::{GrayFrame, Preset};

    fn frame() -> GrayFrame {
        let luma = (0..60 * 50).map(|i| ((i * i / 7 + i) % 251) as u8);
        GrayFrame::from_luma(60, 50, luma.collect()).expect("a frame of this size")
    }

    /// Direction (in bins) and strength of the gradient of the pixel at (`x`, `y`).
    fn gradient(frame: &GrayFrame, x: usize, y: usize) -> (f64, f64) {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let pixel = |x: usize, y: usize| f64::from(frame.pixels()[y * width + x]);
        let across = pixel((x + 1).min(width - 1), y) - pixel(x.saturating_sub(1), y);
        let down = pixel(x, (y + 1).min(height - 1)) - pixel(x, y.saturating_sub(1));
        let turn = down.atan2(across).rem_euclid(std::f64::consts::PI) / std::f64::consts::PI;
        (
            (turn * DIRECTIONS as f64).min(8.9999999),
            across.hypot(down),
        )
    }

    /// Sums over a cell by going through its pixels, each with the share of it that is inside.
    fn cell(frame: &GrayFrame, area: &Rect) -> [f64; CHANNELS] {
        let mut sums = [0.0; CHANNELS];
        let width = frame.width() as usize;
        for y in 0..frame.height() as usize {
            for x in 0..width {
                let (bin, strength) = gradient(frame, x, y);
                let pixel = Rect::new(x as f64, y as f64, 1.0, 1.0);
                let across = (area.x + area.width).min(pixel.x + 1.0) - area.x.max(pixel.x);
                let down = (area.y + area.height).min(pixel.y + 1.0) - area.y.max(pixel.y);
                let share = across.max(0.0) * down.max(0.0);
                let (lower, part) = (bin as usize, bin.fract());
                sums[lower] += share * strength * (1.0 - part);
                sums[(lower + 1) % DIRECTIONS] += share * strength * part;
                sums[DIRECTIONS] += share * f64::from(frame.pixels()[y * width + x]);
            }
        }
        sums
    }

    #[test]
    fn cells_are_sums_over_their_pixels() {
        let frame = frame();
        let (mut sums, mut cells) = (GradientSums::default(), Cells::default());
        cells.prepare(4, 4);
        for area in [
            Rect::new(10.0, 8.0, 32.0, 24.0),
            Rect::new(3.3, 4.7, 21.9, 17.1),
            Rect::new(-9.5, 35.2, 40.0, 30.0),
        ] {
            sums.compute(&frame, &Rect::new(-20.0, 0.0, 75.0, 80.0), (4.0, 4.0));
            let Cells { places, areas, .. } = &mut cells;
            areas[0].sum_up(pulp::Scalar, &sums, &area, (4, 4), places);
            for index in 0..16 {
                let (width, height) = (area.width / 4.0, area.height / 4.0);
                let x = area.x + (index % 4) as f64 * width;
                let y = area.y + (index / 4) as f64 * height;
                let expected = cell(&frame, &Rect::new(x, y, width, height));
                let found = &cells.areas[0].cells[index].0;
                for (found, expected) in found.iter().zip(&expected[..DIRECTIONS]) {
                    assert!(
                        (f64::from(*found) - expected).abs() < 4.0,
                        "{found} {expected}"
                    );
                }
                assert!((f64::from(found[GRAY]) - expected[DIRECTIONS]).abs() < 2.0);
            }
        }
    }

    fn features(frame: &GrayFrame, area: Rect, params: &Params) -> Vec<f32> {
        let mut sums = GradientSums::default();
        let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
        sums.compute(frame, &Rect::new(0.0, 0.0, width, height), (4.0, 4.0));
        let mut out = vec![1.0; params.feature_len()];
        Cells::default().describe(&sums, std::iter::once(area), params, &mut out);
        out
    }

    #[test]
    fn features_are_normalised_by_the_cells_around() {
        let params = Params {
            patch_width: 5,
            patch_height: 4,
            ..Preset::Robust.params()
        };
        let frame = frame();
        let area = Rect::new(9.2, 6.1, 35.0, 30.0);
        let found = features(&frame, area, &params);
        let (width, height) = (area.width / 5.0, area.height / 4.0);
        let place = |i: usize| {
            Rect::new(
                area.x + (i % 5) as f64 * width,
                area.y + (i / 5) as f64 * height,
                width,
                height,
            )
        };
        let cells: Vec<_> = (0..20).map(|i| cell(&frame, &place(i))).collect();
        let energy =
            |cell: &[f64; CHANNELS]| -> f64 { cell[..DIRECTIONS].iter().map(|v| v * v).sum() };
        let mean = cells.iter().map(|cell| cell[DIRECTIONS]).sum::<f64>() / 20.0;
        let variance = cells
            .iter()
            .map(|cell| (cell[DIRECTIONS] - mean).powi(2))
            .sum::<f64>()
            / 20.0;
        for (index, values) in found.chunks_exact(CHANNELS).enumerate() {
            let (i, j) = (index % 5, index / 5);
            let beside = |at: usize| (at % 5).abs_diff(i) <= 1 && (at / 5).abs_diff(j) <= 1;
            let around: Vec<f64> = (0..20)
                .filter(|&at| beside(at))
                .map(|at| energy(&cells[at]))
                .collect();
            let mean_energy = around.iter().sum::<f64>() / around.len() as f64;
            let floor = (f64::from(FLAT) * width * height).powi(2);
            let divisor = 3.0 * (mean_energy + floor).sqrt();
            for (value, sum) in values.iter().zip(&cells[index][..DIRECTIONS]) {
                let expected = (sum / divisor).min(f64::from(GREATEST));
                assert!(
                    (f64::from(*value) - expected).abs() < 2e-3,
                    "{value} {expected}"
                );
            }
            let gray = (cells[index][DIRECTIONS] - mean) * params.gray_weight / variance.sqrt();
            assert!((f64::from(values[DIRECTIONS]) - gray).abs() < 2e-3);
        }
    }

    #[test]
    fn features_hardly_change_with_the_light_and_follow_their_area() {
        let params = Preset::Robust.params();
        let bright = frame();
        let dim = bright.pixels().iter().map(|gray| gray / 2 + 10).collect();
        let dim = GrayFrame::from_luma(60, 50, dim).expect("a frame of this size");
        let area = Rect::new(12.0, 9.0, 30.0, 28.0);
        let distance =
            |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        let here = features(&bright, area, &params);
        let dimmed = distance(&here, &features(&dim, area, &params));
        let moved = Rect { x: 17.0, ..area };
        let moved = distance(&here, &features(&bright, moved, &params));
        assert!(dimmed * 5.0 < moved, "{dimmed} {moved}");
    }

    #[test]
    fn a_flat_area_has_features_of_zero() {
        let flat = GrayFrame::from_luma(20, 20, vec![90; 400]).expect("a frame of this size");
        let params = Preset::Robust.params();
        let out = features(&flat, Rect::new(4.0, 4.0, 12.0, 12.0), &params);
        assert!(out.iter().all(|value| value.abs() < 1e-3));
    }
}
