//! Running sums of two pictures of one size and of their products: what the correlation of the two over any rectangle asks
//! for.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::linalg::scratch::clear_and_reserve;

/// Rectangles whose corners are found together.
pub(crate) const LANES: usize = 8;

/// Sums of the gray values now, then, of their squares and of their products; the rest fills a vector register.
pub(crate) type Sums = [u32; 8];

/// What the sums are of, each a product of two: a lane has what its mask lets through.
const NOW: Sums = [!0, 0, !0, 0, !0, 0, 0, 0];
const THEN: Sums = [0, !0, 0, !0, 0, 0, 0, 0];
const TIMES_NOW: Sums = [0, 0, !0, 0, 0, 0, 0, 0];
const TIMES_THEN: Sums = [0, 0, 0, !0, !0, 0, 0, 0];
const TIMES_ONE: Sums = [1, 1, 0, 0, 0, 0, 0, 0];

/// The sums of a part of two pictures.
#[derive(Debug, Default)]
pub(crate) struct PairIntegral {
    /// Left, top, and how many columns and rows of pixels.
    left: usize,
    top: usize,
    columns: usize,
    rows: usize,
    /// Above and left of each corner of a pixel in the part.
    sums: Vec<Sums>,
}

/// Corners of rectangles, as columns and rows of the part: left, top, right, bottom. None is before the one opposite.
pub(crate) type Corners = [[u32; LANES]; 4];

/// [`PairIntegral::compute`], to be compiled for the instructions that this machine has.
struct Compute<'a, R> {
    sums: &'a mut PairIntegral,
    rows: R,
}

impl<'a, R: ExactSizeIterator<Item = (&'a [u8], &'a [u8])>> WithSimd for Compute<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.sums.compute_all(self.rows);
    }
}

impl PairIntegral {
    /// Makes room for pictures of so many pixels.
    pub fn prepare(&mut self, columns: usize, rows: usize) {
        clear_and_reserve(&mut self.sums, (columns + 1) * (rows + 1));
    }

    /// Becomes the sums of the part that begins at `left` and `top`, of which `rows` gives each row of now and of then;
    /// at most 2¹⁶ pixels.
    pub fn compute<'a>(
        &mut self,
        (left, top): (usize, usize),
        columns: usize,
        rows: impl ExactSizeIterator<Item = (&'a [u8], &'a [u8])>,
    ) {
        (self.left, self.top, self.columns, self.rows) = (left, top, columns, rows.len());
        Arch::new().dispatch(Compute { sums: self, rows });
    }

    #[inline(always)]
    fn compute_all<'a>(&mut self, rows: impl ExactSizeIterator<Item = (&'a [u8], &'a [u8])>) {
        let stride = self.columns + 1;
        self.sums.resize(stride * (rows.len() + 1), [0; 8]);
        let (mut above, mut rest) = self.sums.split_at_mut(stride);
        above.fill([0; 8]);
        for (now, then) in rows {
            let (row, others) = rest.split_at_mut(stride);
            row[0] = [0; 8];
            let mut of_row = [0; 8];
            let sums = row[1..].iter_mut().zip(&above[1..]);
            for ((sums, above), (&now, &then)) in sums.zip(now.iter().zip(then)) {
                let (now, then) = (u32::from(now), u32::from(then));
                for k in 0..8 {
                    let one = now & NOW[k] | then & THEN[k];
                    let other = now & TIMES_NOW[k] | then & TIMES_THEN[k] | TIMES_ONE[k];
                    of_row[k] += one * other;
                    sums[k] = above[k] + of_row[k];
                }
            }
            (above, rest) = (row, others);
        }
    }

    /// The corners of what the part has of rectangles: left, top, right and bottom of each, in pixels of the pictures.
    #[inline(always)]
    pub fn corners(&self, rectangles: &[[f64; LANES]; 4]) -> Corners {
        let along = |values: &[f64; LANES], first: usize, count: usize| {
            let (first, last) = (first as f64, (first + count) as f64);
            let mut out = [0; LANES];
            for (out, value) in out.iter_mut().zip(values) {
                let value = value.round();
                let value = if value > first { value } else { first };
                let value = if value < last { value } else { last };
                // The low bits of 2⁵² + n are n; a conversion would be done one by one.
                *out = (value - first + (1_u64 << 52) as f64).to_bits() as u32;
            }
            out
        };
        let [left, top, right, bottom] = rectangles;
        let (left, top) = (
            along(left, self.left, self.columns),
            along(top, self.top, self.rows),
        );
        let (mut right, mut bottom) = (
            along(right, self.left, self.columns),
            along(bottom, self.top, self.rows),
        );
        for lane in 0..LANES {
            right[lane] = right[lane].max(left[lane]);
            bottom[lane] = bottom[lane].max(top[lane]);
        }
        [left, top, right, bottom]
    }

    /// The numbers of pixels in rectangles.
    #[inline(always)]
    pub fn pixels([left, top, right, bottom]: &Corners) -> [u32; LANES] {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = (right[lane] - left[lane]) * (bottom[lane] - top[lane]);
        }
        out
    }

    /// The sums over one of these rectangles.
    #[inline(always)]
    pub fn over(&self, [left, top, right, bottom]: &Corners, lane: usize) -> Sums {
        let row = |row: u32| &self.sums[row as usize * (self.columns + 1)..];
        let (upper, lower) = (row(top[lane]), row(bottom[lane]));
        let (left, right) = (left[lane] as usize, right[lane] as usize);
        let (a, b, c, d) = (upper[left], upper[right], lower[left], lower[right]);
        let mut sums = [0; 8];
        for k in 0..8 {
            sums[k] = (d[k] - c[k]) - (b[k] - a[k]);
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_pixels() {
        let (width, height) = (23, 17);
        let picture = |seed: usize| -> Vec<u8> {
            (0..width * height)
                .map(|i| (i * i * 7 + i * seed) as u8)
                .collect()
        };
        let (now, then) = (picture(3), picture(11));
        let mut sums = PairIntegral::default();
        // What is left of a larger part is of no account.
        for (left, top, columns, rows) in [(0, 0, 23, 17), (3, 2, 14, 9), (20, 16, 1, 1)] {
            sums.prepare(width, height);
            let of_picture =
                |picture: &[u8], row| picture[row * width + left..][..columns].to_vec();
            let rows_of = |picture: &[u8]| -> Vec<Vec<u8>> {
                (top..top + rows)
                    .map(|row| of_picture(picture, row))
                    .collect()
            };
            let (of_now, of_then) = (rows_of(&now), rows_of(&then));
            let pairs = of_now.iter().zip(&of_then);
            sums.compute((left, top), columns, pairs.map(|(a, b)| (&a[..], &b[..])));
            let at = |lane: usize, seed: usize| (lane * seed % 53) as f64 * 0.61 - 4.5;
            let lanes = |seed| std::array::from_fn(|lane| at(lane, seed));
            for seed in 1..40 {
                let rectangles: [[f64; LANES]; 4] = [
                    lanes(seed),
                    lanes(seed + 5),
                    lanes(seed + 9),
                    lanes(seed + 2),
                ];
                let corners = sums.corners(&rectangles);
                let pixels = PairIntegral::pixels(&corners);
                for lane in 0..LANES {
                    let [x0, y0, x1, y1] = rectangles.map(|side| side[lane].round());
                    let mut expected = [0; 8];
                    let mut count = 0;
                    for index in 0..width * height {
                        let (x, y) = (index % width, index / width);
                        let inside = (left..left + columns).contains(&x)
                            && (top..top + rows).contains(&y)
                            && (x0..x1).contains(&(x as f64))
                            && (y0..y1).contains(&(y as f64));
                        if inside {
                            let (a, b) = (u32::from(now[index]), u32::from(then[index]));
                            let values = [a, b, a * a, b * b, a * b];
                            for (sum, value) in expected.iter_mut().zip(values) {
                                *sum += value;
                            }
                            count += 1;
                        }
                    }
                    assert_eq!(sums.over(&corners, lane), expected);
                    assert_eq!(pixels[lane], count);
                }
            }
        }
    }
}
