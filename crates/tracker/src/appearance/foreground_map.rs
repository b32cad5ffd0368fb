//! The foreground of a frame: for each pixel around the target the probability that its colour is the target's, summed
//! over boxes by an integral image.

use crate::appearance::color_histogram::{ColorHistogram, ColorPixels, Part};
use crate::linalg::scratch::clear_and_reserve;
use crate::motion::particles::{Particle, StateBounds};

/// How many times as large as the last box a box may be.
const SCALE_MARGIN: f64 = 1.2;

/// The integral image of the probabilities minus a half, and its buffers.
#[derive(Debug, Default)]
pub(crate) struct ForegroundMap {
    part: Part,
    /// The side of a pixel of the map, in working pixels.
    side: f64,
    /// For each corner of a pixel of the part the sum over what is above and left of it; empty where nothing is known.
    sums: Vec<f32>,
    posterior: Vec<f32>,
    bins: Vec<u16>,
}

impl ForegroundMap {
    /// Becomes the map of the frame of `pixels` for boxes within `radius` working pixels of the box of `center`.
    pub fn compute(
        &mut self,
        pixels: ColorPixels<'_>,
        histogram: &ColorHistogram,
        center: &Particle,
        radius: f64,
        bounds: &StateBounds,
    ) {
        // Room for the widest search, so that no later frame allocates.
        clear_and_reserve(&mut self.sums, (pixels.columns() + 1) * (pixels.rows() + 1));
        if !histogram.has_learned() {
            return;
        }
        histogram.posterior(&mut self.posterior);
        self.side = pixels.side();
        self.part = pixels.part(center, bounds, SCALE_MARGIN, radius + 2.0 * self.side);
        let part = self.part;
        let stride = part.right - part.left + 1;
        self.sums.resize(stride * (part.bottom - part.top + 1), 0.0);
        for (row, y) in (part.top..part.bottom).enumerate() {
            pixels.bins(&part, y, &mut self.bins);
            let (above, below) = self.sums[row * stride..].split_at_mut(stride);
            let mut sum = 0.0;
            let corners = below[1..].iter_mut().zip(&above[1..]);
            for ((below, above), &bin) in corners.zip(&self.bins) {
                sum += self.posterior[usize::from(bin)];
                *below = above + sum;
            }
        }
    }

    /// The sum over the box of `particle`, as a share of the box's area at `scale`: -1/2 to 1/2 where `particle` has
    /// that scale. 0 where nothing is known.
    #[inline(always)]
    pub fn mean(&self, particle: &Particle, scale: f64, bounds: &StateBounds) -> f64 {
        if self.sums.is_empty() {
            return 0.0;
        }
        let area = bounds.area(particle).in_pixels_of(self.side);
        let (left, top) = (area.x, area.y);
        let (right, bottom) = (left + area.width, top + area.height);
        let sum = self.at(right, bottom) - self.at(left, bottom) - self.at(right, top)
            + self.at(left, top);
        let usual = bounds.box_width * bounds.box_height * scale * scale;
        f64::from(sum) * self.side * self.side / usual
    }

    /// The sum above and left of a point, interpolated between corners.
    #[inline(always)]
    fn at(&self, x: f64, y: f64) -> f32 {
        let (columns, rows) = (
            self.part.right - self.part.left,
            self.part.bottom - self.part.top,
        );
        let stride = columns + 1;
        let x = (x - self.part.left as f64).clamp(0.0, columns as f64);
        let y = (y - self.part.top as f64).clamp(0.0, rows as f64);
        let (column, row) = (
            (x as usize).min(columns.saturating_sub(1)),
            (y as usize).min(rows.saturating_sub(1)),
        );
        let (right, down) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let corner =
            |column: usize, row: usize| self.sums[row.min(rows) * stride + column.min(columns)];
        let upper = corner(column, row) + (corner(column + 1, row) - corner(column, row)) * right;
        let lower = corner(column, row + 1)
            + (corner(column + 1, row + 1) - corner(column, row + 1)) * right;
        upper + (lower - upper) * down
    }
}
