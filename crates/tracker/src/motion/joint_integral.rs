//! Integral images of two small images of one size: what the correlation of the two over any rectangle needs.

use pulp::{Arch, Simd};

use crate::image::rect::Rect;
use crate::linalg::scratch::clear_and_reserve;

/// Sums over a rectangle: of the gray values of the present image, of those of the earlier image, of the squares of
/// each, and of the products of both.
pub(crate) type Sums = [u32; 5];

/// The sums over all rectangles of a part of the two images.
#[derive(Debug, Default)]
pub(crate) struct JointIntegral {
    left: usize,
    top: usize,
    columns: usize,
    rows: usize,
    /// For each corner of a pixel of the part, the sums over what is above and left of it.
    sums: Vec<Sums>,
}

impl JointIntegral {
    /// Forgets the last images, and makes room for a part whose pixels and rows together are `count`.
    pub fn reserve(&mut self, count: usize) {
        // A corner more than pixels in each row, and one row more.
        clear_and_reserve(&mut self.sums, 2 * count + 1);
    }

    /// Becomes the sums of the part that begins at `left` and `top`, whose rows in the present and in the earlier image
    /// are `rows`; at most 2¹⁶ pixels.
    pub fn compute<'a>(
        &mut self,
        (left, top): (usize, usize),
        columns: usize,
        rows: impl ExactSizeIterator<Item = (&'a [u8], &'a [u8])>,
    ) {
        (self.left, self.top, self.columns, self.rows) = (left, top, columns, rows.len());
        let stride = columns + 1;
        self.sums.clear();
        self.sums.resize(stride * (rows.len() + 1), [0; 5]);
        for (row, (now, then)) in rows.enumerate() {
            let (above, below) = self.sums.split_at_mut((row + 1) * stride);
            sum_row(now, then, &above[row * stride..], &mut below[..stride]);
        }
    }

    /// The number of pixels of the part in `area`, whose edges count to the nearest pixel, and the sums over them.
    pub fn over(&self, area: &Rect) -> (u32, Sums) {
        let corner = |value: f64, first: usize, count: usize| {
            // Adding one half and truncating rounds to the nearest; `f64::round` would be a function call here.
            (value + 0.5 - first as f64).clamp(0.0, count as f64) as usize
        };
        let left = corner(area.x, self.left, self.columns);
        let right = corner(area.x + area.width, self.left, self.columns).max(left);
        let top = corner(area.y, self.top, self.rows);
        let bottom = corner(area.y + area.height, self.top, self.rows).max(top);
        let at = |column: usize, row: usize| &self.sums[row * (self.columns + 1) + column];
        let (a, b) = (at(left, top), at(right, top));
        let (c, d) = (at(left, bottom), at(right, bottom));
        let sums = std::array::from_fn(|k| (d[k] - c[k]) - (b[k] - a[k]));
        (((right - left) * (bottom - top)) as u32, sums)
    }
}

#[pulp::with_simd(sum_row = Arch::new())]
#[inline(always)]
fn sum_row_simd<S: Simd>(_: S, now: &[u8], then: &[u8], above: &[Sums], below: &mut [Sums]) {
    let mut row = [0; 5];
    let sums = below[1..].iter_mut().zip(&above[1..]);
    for ((sums, above), (&now, &then)) in sums.zip(now.iter().zip(then)) {
        let (now, then) = (u32::from(now), u32::from(then));
        let values = [now, then, now * now, then * then, now * then];
        for k in 0..5 {
            row[k] += values[k];
            sums[k] = above[k] + row[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_pixels() {
        let (width, height) = (23, 17);
        let image = |seed: usize| -> Vec<u8> {
            let pixels = (0..width * height).map(|i| (i * i * 7 + i * seed) as u8);
            pixels.collect()
        };
        let (now, then) = (image(3), image(11));
        let mut integral = JointIntegral::default();
        // What is left of a larger part does not count.
        for (left, top, columns, rows) in [(0, 0, 23, 17), (3, 2, 14, 9), (20, 16, 1, 1)] {
            let row = |row: usize| row * width + left..row * width + left + columns;
            let pairs = (top..top + rows).map(|at| (&now[row(at)], &then[row(at)]));
            integral.compute((left, top), columns, pairs);
            for seed in 1..40 {
                let at = |seed: usize| (seed * 31 % 53) as f64 * 0.61 - 4.5;
                let area = Rect::new(
                    at(seed),
                    at(seed + 5),
                    at(seed + 9).abs(),
                    at(seed + 2).abs(),
                );
                let (x, y) = (area.x.round(), area.y.round());
                let right = (area.x + area.width).round();
                let bottom = (area.y + area.height).round();
                let (mut expected, mut count) = ([0; 5], 0);
                for index in 0..width * height {
                    let (column, row) = (index % width, index / width);
                    let inside = (left..left + columns).contains(&column)
                        && (top..top + rows).contains(&row)
                        && (x..right).contains(&(column as f64))
                        && (y..bottom).contains(&(row as f64));
                    if inside {
                        let (a, b) = (u32::from(now[index]), u32::from(then[index]));
                        let values = [a, b, a * a, b * b, a * b];
                        for (sum, value) in expected.iter_mut().zip(values) {
                            *sum += value;
                        }
                        count += 1;
                    }
                }
                assert_eq!(integral.over(&area), (count, expected));
            }
        }
    }
}
