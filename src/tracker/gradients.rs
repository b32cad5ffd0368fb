//! From a candidate area to gradient features: how strong edges are, by direction, in a grid of cells.
//!
//! Histograms of oriented gradients (Dalal and Triggs, 2005), nine unsigned directions softly binned, and the mean gray
//! value of each cell beside them. Cells of hundreds of overlapping candidates are sums over the same pixels, so
//! running sums of each channel over a window are made once a frame, and a cell is four look-ups. The sums are
//! interpolated between pixels: cells of a small target are a few pixels wide, and rounding them would move the target.

use super::{GrayFrame, Params, Rect};

/// Directions, from 0 to 180 degrees.
const DIRECTIONS: usize = 9;
/// Values of a cell: the directions, then its gray value.
pub(super) const CHANNELS: usize = DIRECTIONS + 1;
/// Numbers a pixel in the running sums; more than channels so that loops are of a round length.
const LANES: usize = 12;
const GRAY: usize = LANES - 1;

/// The greatest normalised value of a direction, so that one strong edge does not outweigh all else.
const GREATEST: f32 = 0.4;
/// Gradients of flat cells are noise: this much, in gray levels a pixel, is added to what they are divided by.
const FLAT: f32 = 2.0;
/// The least standard deviation of gray values, in gray levels, that theirs are divided by.
const LEAST_CONTRAST: f32 = 4.0;

type Lanes = [f32; LANES];

/// Running sums of the channels over a window of a frame.
#[derive(Debug, Clone, Default)]
pub(super) struct GradientSums {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    /// `(height + 1) * (width + 1)`: the sum over all pixels of the window above and left of a corner.
    sums: Vec<Lanes>,
    /// For each pixel of a row, its direction in units of bins, and its strength.
    row: Vec<(f32, f32)>,
    cells: Vec<Lanes>,
    corners: Vec<Lanes>,
}

impl GradientSums {
    /// Sums up the channels over the part of `frame` that `window` (working pixels) touches.
    pub fn compute(&mut self, frame: &GrayFrame, window: &Rect) {
        let (left, right) = span(window.x, window.width, frame.width() as usize);
        let (top, bottom) = span(window.y, window.height, frame.height() as usize);
        (self.left, self.top) = (left, top);
        (self.width, self.height) = (right - left, bottom - top);
        let stride = self.width + 1;
        self.sums.resize(stride * (self.height + 1), [0.0; LANES]);
        self.sums[..stride].fill([0.0; LANES]);
        for y in 0..self.height {
            gradient_row(frame, left, top + y, self.width, &mut self.row);
            let gray = &frame.pixels()[(top + y) * frame.width() as usize + left..];
            let (above, below) = self.sums.split_at_mut((y + 1) * stride);
            let above = &above[y * stride + 1..];
            let (first, below) = below[..stride]
                .split_first_mut()
                .expect("a row of sums has one more than the window's pixels");
            *first = [0.0; LANES];
            let mut total = [0.0; LANES];
            let pixels = self.row.iter().zip(gray);
            for (((&(bin, strength), &gray), above), below) in pixels.zip(above).zip(below) {
                let lower = bin as usize;
                let share = bin - lower as f32;
                let upper = if lower + 1 == DIRECTIONS {
                    0
                } else {
                    lower + 1
                };
                total[lower] += strength * (1.0 - share);
                total[upper] += strength * share;
                total[GRAY] += f32::from(gray);
                for lane in 0..LANES {
                    below[lane] = above[lane] + total[lane];
                }
            }
        }
    }

    /// The sum at a point, in working pixels, interpolated between the four corners around it. Outside the window
    /// there is nothing.
    fn at(&self, x: f32, y: f32) -> Lanes {
        let x = (x - self.left as f32).clamp(0.0, self.width as f32);
        let y = (y - self.top as f32).clamp(0.0, self.height as f32);
        let (column, row) = (
            (x as usize).min(self.width - 1),
            (y as usize).min(self.height - 1),
        );
        let (right, down) = (x - column as f32, y - row as f32);
        let stride = self.width + 1;
        let upper = &self.sums[row * stride + column..][..2];
        let lower = &self.sums[(row + 1) * stride + column..][..2];
        let weights = [
            (1.0 - right) * (1.0 - down),
            right * (1.0 - down),
            (1.0 - right) * down,
            right * down,
        ];
        std::array::from_fn(|lane| {
            upper[0][lane] * weights[0]
                + upper[1][lane] * weights[1]
                + lower[0][lane] * weights[2]
                + lower[1][lane] * weights[3]
        })
    }

    /// Writes the feature vector of `area` (working pixels, sides above 0, in the window that was summed up) to `out`,
    /// of length D: cell by cell, row by row, the nine directions and the gray value.
    ///
    /// Each cell's directions are divided by the root of the mean energy of the 3 x 3 cells around it and clipped.
    /// Gray values have the area's mean taken off and are divided by its standard deviation.
    pub fn features(&mut self, area: &Rect, params: &Params, out: &mut [f32]) {
        let (columns, rows) = (params.patch_width as usize, params.patch_height as usize);
        let width = (area.width / columns as f64) as f32;
        let height = (area.height / rows as f64) as f32;
        self.sum_cells(area, columns, rows, width, height);

        let pixels = width * height;
        let count = (columns * rows) as f32;
        let mean = self.cells.iter().map(|cell| cell[GRAY]).sum::<f32>() / count;
        let squares = self.cells.iter().map(|cell| (cell[GRAY] - mean).powi(2));
        let deviation = (squares.sum::<f32>() / count).sqrt();
        let gray_scale = params.gray_weight as f32 / deviation.max(LEAST_CONTRAST * pixels);
        let floor = (FLAT * pixels).powi(2);
        for (index, values) in out.chunks_exact_mut(CHANNELS).enumerate() {
            let energy = self.energy_around(index % columns, index / columns, columns, rows);
            let scale = 1.0 / (3.0 * (energy + floor).sqrt());
            let cell = &self.cells[index];
            for (value, sum) in values.iter_mut().zip(&cell[..DIRECTIONS]) {
                *value = (sum * scale).min(GREATEST);
            }
            values[DIRECTIONS] = (cell[GRAY] - mean) * gray_scale;
        }
    }

    /// Sums over each cell, from the sums at the cells' corners. The energy of the directions takes a spare lane.
    fn sum_cells(&mut self, area: &Rect, columns: usize, rows: usize, width: f32, height: f32) {
        let (x, y) = (area.x as f32, area.y as f32);
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for j in 0..=rows {
            for i in 0..=columns {
                corners.push(self.at(x + i as f32 * width, y + j as f32 * height));
            }
        }
        self.cells.clear();
        for j in 0..rows {
            let above = &corners[j * (columns + 1)..][..columns + 1];
            let below = &corners[(j + 1) * (columns + 1)..][..columns + 1];
            for i in 0..columns {
                let mut cell: Lanes = std::array::from_fn(|lane| {
                    below[i + 1][lane] - below[i][lane] - above[i + 1][lane] + above[i][lane]
                });
                cell[ENERGY] = cell[..DIRECTIONS].iter().map(|sum| sum * sum).sum();
                self.cells.push(cell);
            }
        }
        self.corners = corners;
    }

    /// The mean energy of the cells around one, itself among them.
    fn energy_around(&self, column: usize, row: usize, columns: usize, rows: usize) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0);
        for j in row.saturating_sub(1)..(row + 2).min(rows) {
            for i in column.saturating_sub(1)..(column + 2).min(columns) {
                sum += self.cells[j * columns + i][ENERGY];
                count += 1.0;
            }
        }
        sum / count
    }
}

/// The lane of a cell that its energy is kept in.
const ENERGY: usize = DIRECTIONS;

/// The pixels from `start` over `extent`, within `count` pixels: at least one.
fn span(start: f64, extent: f64, count: usize) -> (usize, usize) {
    let first = (start.floor().max(0.0) as usize).min(count - 1);
    let last = ((start + extent).ceil().max(0.0) as usize).clamp(first + 1, count);
    (first, last)
}

/// Direction (in bins) and strength of the gradient, by central differences, of `count` pixels from (`left`, `y`).
fn gradient_row(frame: &GrayFrame, left: usize, y: usize, count: usize, out: &mut Vec<(f32, f32)>) {
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    let row = |y: usize| &frame.pixels()[y * width..][..width];
    let (above, here, below) = (
        row(y.saturating_sub(1)),
        row(y),
        row((y + 1).min(height - 1)),
    );
    out.clear();
    out.extend((left..left + count).map(|x| {
        let across = f32::from(here[(x + 1).min(width - 1)]) - f32::from(here[x.saturating_sub(1)]);
        let down = f32::from(below[x]) - f32::from(above[x]);
        let bin = angle(across, down) * (DIRECTIONS as f32 / std::f32::consts::PI);
        // Rounding can put an angle just below 180 degrees at it.
        let bin = if bin < DIRECTIONS as f32 { bin } else { 0.0 };
        (bin, (across * across + down * down).sqrt())
    }));
}

/// The unsigned angle of (x, y), from 0 to π, to 0.0003: a polynomial that vectorises (minimax fit of the arc tangent
/// on \[0, 1\]), several times as fast as `atan2`.
fn angle(x: f32, y: f32) -> f32 {
    let (across, down) = (x.abs(), y.abs());
    let ratio = across.min(down) / across.max(down).max(1e-9);
    let square = ratio * ratio;
    let octant =
        ((-0.046_496_475 * square + 0.159_314_22) * square - 0.327_622_76) * square * ratio + ratio;
    let quadrant = if down > across {
        std::f32::consts::FRAC_PI_2 - octant
    } else {
        octant
    };
    if (x < 0.0) != (y < 0.0) {
        std::f32::consts::PI - quadrant
    } else {
        quadrant
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::Preset;

    fn frame() -> GrayFrame {
        let luma = (0..60 * 50).map(|i| ((i * i / 7 + i) % 251) as u8);
        GrayFrame::from_luma(60, 50, luma.collect()).expect("a frame of this size")
    }

    #[test]
    fn angles_are_those_of_atan2() {
        for step in 0..2000 {
            let turn = f64::from(step) * std::f64::consts::TAU / 2000.0;
            let (x, y) = ((turn.cos() * 200.0) as f32, (turn.sin() * 200.0) as f32);
            let expected = f64::from(y)
                .atan2(f64::from(x))
                .rem_euclid(std::f64::consts::PI);
            let difference = (f64::from(angle(x, y)) - expected).abs();
            let difference = difference.min(std::f64::consts::PI - difference);
            assert!(difference < 3e-4, "{x}, {y}: {difference}");
        }
    }

    /// Sums over a cell by going through its pixels, each with the share of it that is inside.
    fn cell(frame: &GrayFrame, area: &Rect) -> [f64; CHANNELS] {
        let mut sums = [0.0; CHANNELS];
        let mut row = Vec::new();
        let width = frame.width() as usize;
        for y in 0..frame.height() as usize {
            gradient_row(frame, 0, y, width, &mut row);
            for (x, &(bin, strength)) in row.iter().enumerate() {
                let pixel = Rect::new(x as f64, y as f64, 1.0, 1.0);
                let across = (area.x + area.width).min(pixel.x + 1.0) - area.x.max(pixel.x);
                let down = (area.y + area.height).min(pixel.y + 1.0) - area.y.max(pixel.y);
                let share = across.max(0.0) * down.max(0.0);
                let (lower, part) = (bin as usize, f64::from(bin.fract()));
                sums[lower] += share * f64::from(strength) * (1.0 - part);
                sums[(lower + 1) % DIRECTIONS] += share * f64::from(strength) * part;
                sums[DIRECTIONS] += share * f64::from(frame.pixels()[y * width + x]);
            }
        }
        sums
    }

    #[test]
    fn cells_are_sums_over_their_pixels() {
        let frame = frame();
        let mut sums = GradientSums::default();
        for area in [
            Rect::new(10.0, 8.0, 32.0, 24.0),
            Rect::new(3.3, 4.7, 21.9, 17.1),
            Rect::new(-9.5, 35.2, 40.0, 30.0),
        ] {
            sums.compute(&frame, &Rect::new(-20.0, 0.0, 75.0, 80.0));
            sums.sum_cells(
                &area,
                4,
                4,
                area.width as f32 / 4.0,
                area.height as f32 / 4.0,
            );
            for index in 0..16 {
                let (width, height) = (area.width / 4.0, area.height / 4.0);
                let x = area.x + (index % 4) as f64 * width;
                let y = area.y + (index / 4) as f64 * height;
                let expected = cell(&frame, &Rect::new(x, y, width, height));
                let found = &sums.cells[index];
                for (found, expected) in found.iter().zip(&expected[..DIRECTIONS]) {
                    assert!(
                        (f64::from(*found) - expected).abs() < 2.0,
                        "{found} {expected}"
                    );
                }
                assert!((f64::from(found[GRAY]) - expected[DIRECTIONS]).abs() < 2.0);
            }
        }
    }

    #[test]
    fn features_hardly_change_with_the_light_and_follow_their_area() {
        let params = Preset::Robust.params();
        let bright = frame();
        let dim = bright.pixels().iter().map(|gray| gray / 2 + 10).collect();
        let dim = GrayFrame::from_luma(60, 50, dim).expect("a frame of this size");
        let area = Rect::new(12.0, 9.0, 30.0, 28.0);
        let features = |frame: &GrayFrame, area: &Rect| {
            let mut sums = GradientSums::default();
            sums.compute(frame, &Rect::new(0.0, 0.0, 60.0, 50.0));
            let mut out = vec![0.0; params.feature_len()];
            sums.features(area, &params, &mut out);
            out
        };
        let distance =
            |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        let here = features(&bright, &area);
        let dimmed = distance(&here, &features(&dim, &area));
        let moved = Rect { x: 17.0, ..area };
        let moved = distance(&here, &features(&bright, &moved));
        assert!(dimmed * 5.0 < moved, "{dimmed} {moved}");
    }

    #[test]
    fn a_flat_area_has_features_of_zero() {
        let flat = GrayFrame::from_luma(20, 20, vec![90; 400]).expect("a frame of this size");
        let mut sums = GradientSums::default();
        sums.compute(&flat, &Rect::new(0.0, 0.0, 20.0, 20.0));
        let params = Preset::Robust.params();
        let mut out = vec![1.0; params.feature_len()];
        sums.features(&Rect::new(4.0, 4.0, 12.0, 12.0), &params, &mut out);
        assert!(out.iter().all(|value| value.abs() < 1e-3));
    }
}
