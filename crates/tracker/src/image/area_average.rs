//! Exact area averaging, in whole numbers.
//!
//! Along each axis, target pixel `o` covers the source interval `[o * S / T, (o + 1) * S / T)` for source size `S` and
//! target size `T`. In units of `1 / T` source pixel every interval has the length `S`, and its shares of source pixels
//! are whole numbers too. So the average is exact up to the final rounding.

use std::ops::Range;

use num_traits::{AsPrimitive, WrappingAdd, WrappingMul, WrappingSub};
use pulp::{Arch, Simd};

/// Added to a number below 2^51, it leaves the nearest whole number in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Target rows that are averaged together, in one vector register of SSE or WebAssembly. Columns are not, since which
/// source columns a target pixel covers changes from one to the next. Twice as many rows were slower.
const ROWS: usize = 4;

/// The source pixels of one target pixel: `begin..end` wholly, the one before and the one after in part, in units of
/// `1 / T`.
struct Cell {
    begin: usize,
    end: usize,
    before: u32,
    after: u32,
}

/// The source pixels that each target pixel covers, `target <= source`.
fn cells(source: u32, target: u32) -> Vec<Cell> {
    let (source, target) = (u64::from(source), u64::from(target));
    (0..target)
        .map(|index| {
            let (from, until) = (index * source, (index + 1) * source);
            let (begin, end) = (from.div_ceil(target), until / target);
            Cell {
                begin: begin as usize,
                end: end as usize,
                before: (begin * target - from) as u32,
                after: (until - end * target) as u32,
            }
        })
        .collect()
}

/// The area average of `luma` (`source` = width, height, row by row) on a grid of `target` = width, height. No target
/// side is longer than its source side. The averages are appended to `out`.
#[pulp::with_simd(area_average = Arch::new())]
#[inline(always)]
pub fn area_average_simd<S: Simd>(
    _: S,
    luma: &[u8],
    source: (u32, u32),
    target: (u32, u32),
    out: &mut Vec<u8>,
) {
    let first = out.len();
    out.resize(first + target.0 as usize * target.1 as usize, 0);
    let averages = &mut out[first..];
    let (width, columns) = (source.0 as usize, target.0 as usize);
    let factor = source.0 / target.0;
    let is_whole = source == (factor * target.0, factor * target.1);
    match (is_whole, factor) {
        (true, 2) => square_means::<2>(luma, width, 0..columns, averages),
        (true, 3) => square_means::<3>(luma, width, 0..columns, averages),
        (true, 4) => square_means::<4>(luma, width, 0..columns, averages),
        (true, 6) => square_means::<6>(luma, width, 0..columns, averages),
        _ => any_sizes(luma, source, target, averages),
    }
}

/// The means of whole squares of `FACTOR` pixels a side, rounded, of the squares in `columns`. `pixels` begins with the
/// first row of squares, and the length of `out` tells how many rows there are.
#[inline(always)]
pub(crate) fn square_means<const FACTOR: usize>(
    pixels: &[u8],
    width: usize,
    columns: Range<usize>,
    out: &mut [u8],
) {
    let bands = pixels.chunks_exact(FACTOR * width);
    for (out, band) in out.chunks_exact_mut(columns.len()).zip(bands) {
        let lines: [&[[u8; FACTOR]]; FACTOR] =
            std::array::from_fn(|row| &band[row * width..][..width].as_chunks().0[columns.clone()]);
        for (i, out) in out.iter_mut().enumerate() {
            let mut sum = 0;
            // Two plain loops become vector instructions; an iterator over the square does not.
            for line in lines {
                for value in line[i] {
                    sum += u16::from(value);
                }
            }
            let count = (FACTOR * FACTOR) as u16;
            *out = ((sum + count / 2) / count) as u8;
        }
    }
}

/// [`area_average`] for any sizes.
#[inline(always)]
fn any_sizes(luma: &[u8], source: (u32, u32), target: (u32, u32), out: &mut [u8]) {
    let largest = u64::from(u8::MAX) * u64::from(source.0) * u64::from(source.1);
    match u32::try_from(largest) {
        Ok(_) => average::<u32>(luma, source, target, out),
        Err(_) => average::<u64>(luma, source, target, out),
    }
}

/// [`area_average`], where `Sum` holds the weighted sum of a target pixel: up to 255 times the number of the source's
/// pixels. Sums over more columns may wrap around; their difference is right all the same.
#[inline(always)]
fn average<Sum>(luma: &[u8], source: (u32, u32), target: (u32, u32), out: &mut [u8])
where
    Sum: WrappingAdd + WrappingMul + WrappingSub + Default + AsPrimitive<f64>,
    u32: AsPrimitive<Sum>,
{
    let (width, columns) = (source.0 as usize, target.0 as usize);
    let boundaries = boundaries(source.0, target.0);
    let unit: Sum = target.0.as_();
    let divisor = Divisor::new(u64::from(source.0) * u64::from(source.1));
    let mut sums: [Vec<u32>; ROWS] = std::array::from_fn(|_| vec![0; width]);
    // The last target pixel ends where the last column ends. The value after that is read, and counts 0 times.
    let mut integral = vec![[Sum::default(); ROWS]; width + 2];
    let mut totals = vec![[Sum::default(); ROWS]; columns];
    let mut averages = vec![[0_u8; ROWS]; columns];
    let cells = cells(source.1, target.1);
    for (cells, out) in cells.chunks(ROWS).zip(out.chunks_mut(ROWS * columns)) {
        // Rows are summed first: that loop runs over every source pixel, and in this order its memory is contiguous.
        for (cell, sums) in cells.iter().zip(&mut sums) {
            sum_rows(luma, cell, target.1, sums);
        }
        integrate(&sums, &mut integral);
        let mut begin = [Sum::default(); ROWS];
        for (total, &(boundary, part)) in totals.iter_mut().zip(&boundaries[1..]) {
            let [before, after] = &integral[boundary as usize..].as_chunks::<2>().0[0];
            let (part, mut end): (Sum, _) = (part.as_(), [Sum::default(); ROWS]);
            for row in 0..ROWS {
                // In units of `1 / T`.
                let within = after[row].wrapping_sub(&before[row]).wrapping_mul(&part);
                end[row] = before[row].wrapping_mul(&unit).wrapping_add(&within);
            }
            for row in 0..ROWS {
                total[row] = end[row].wrapping_sub(&begin[row]);
            }
            begin = end;
        }
        let quotients = averages.as_flattened_mut().iter_mut();
        for (average, &total) in quotients.zip(totals.as_flattened()) {
            *average = divisor.rounded(total.as_());
        }
        for (row, out) in out.chunks_exact_mut(columns).enumerate() {
            for (out, averages) in out.iter_mut().zip(&averages) {
                *out = averages[row];
            }
        }
    }
}

/// Replaces `sums` by the sum of a target row's source rows, in units of `1 / height`.
#[inline(always)]
fn sum_rows(luma: &[u8], cell: &Cell, height: u32, sums: &mut [u32]) {
    let width = sums.len();
    sums.fill(0);
    let mut add = |row: usize, share: u32| {
        for (sum, &value) in sums.iter_mut().zip(&luma[row * width..][..width]) {
            *sum += u32::from(value) * share;
        }
    };
    if cell.before > 0 {
        add(cell.begin - 1, cell.before);
    }
    for row in cell.begin..cell.end {
        add(row, height);
    }
    if cell.after > 0 {
        add(cell.end, cell.after);
    }
}

/// Sets each of `integral` but the first to the sums over the columns before it.
#[inline(always)]
fn integrate<Sum>(sums: &[Vec<u32>; ROWS], integral: &mut [[Sum; ROWS]])
where
    Sum: WrappingAdd + Default + Copy + 'static,
    u32: AsPrimitive<Sum>,
{
    let mut total = [Sum::default(); ROWS];
    let width = sums[0].len();
    let sums = sums.each_ref().map(|sums| &sums[..width]);
    for (column, integral) in integral[1..=width].iter_mut().enumerate() {
        for row in 0..ROWS {
            total[row] = total[row].wrapping_add(&sums[row][column].as_());
        }
        *integral = total;
    }
}

/// Where each target pixel begins, and where the last one ends: a source column, and how much of it lies before the
/// boundary, in units of `1 / T`.
fn boundaries(source: u32, target: u32) -> Vec<(u32, u32)> {
    let (source, target) = (u64::from(source), u64::from(target));
    (0..=target)
        .map(|index| index * source)
        .map(|at| ((at / target) as u32, (at % target) as u32))
        .collect()
}

/// A divisor of many values that are at most 255 times as large. A division would take longer than everything else that
/// is done for a target pixel.
struct Divisor {
    inverse: f64,
}

impl Divisor {
    #[inline(always)]
    fn new(divisor: u64) -> Self {
        Self {
            inverse: 1.0 / divisor as f64,
        }
    }

    /// The nearest whole number to the quotient, of two equally near ones the larger; `value` is a whole number. As
    /// long as the divisor is below 2^40, the 0.25 that is added to the value outweighs the rounding, and does not
    /// reach the next quotient.
    #[inline(always)]
    fn rounded(&self, value: f64) -> u8 {
        ((value + 0.25) * self.inverse + ROUND).to_bits() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The averages by their definition: overlaps of intervals, in floating point.
    fn by_definition(luma: &[u8], source: (u32, u32), target: (u32, u32)) -> Vec<f64> {
        let overlap = |o: u32, s: u32, source: u32, target: u32| {
            let ratio = f64::from(source) / f64::from(target);
            let (begin, end) = (f64::from(o) * ratio, f64::from(o + 1) * ratio);
            ((f64::from(s) + 1.0).min(end) - f64::from(s).max(begin)).max(0.0) / ratio
        };
        let mut out = Vec::new();
        for row in 0..target.1 {
            for column in 0..target.0 {
                let mut sum = 0.0;
                for y in 0..source.1 {
                    let vertical = overlap(row, y, source.1, target.1);
                    for x in 0..source.0 {
                        let share = vertical * overlap(column, x, source.0, target.0);
                        sum += share * f64::from(luma[(y * source.0 + x) as usize]);
                    }
                }
                out.push(sum);
            }
        }
        out
    }

    #[test]
    fn averages_are_exact_up_to_rounding() {
        for (source, target) in [
            ((7, 5), (3, 2)),
            ((8, 6), (4, 3)),
            ((9, 4), (9, 1)),
            ((13, 11), (12, 11)),
            ((5, 1), (2, 1)),
            ((1, 9), (1, 4)),
            ((6, 6), (6, 6)),
            ((12, 8), (3, 2)),
            ((18, 12), (3, 2)),
            ((9, 15), (3, 5)),
        ] {
            let luma: Vec<u8> = (0..source.0 * source.1)
                .map(|i| (i * 89 % 256) as u8)
                .collect();
            let mut averages = Vec::new();
            area_average(&luma, source, target, &mut averages);
            let expected = by_definition(&luma, source, target);
            assert_eq!(averages.len(), expected.len());
            for (&average, &expected) in averages.iter().zip(&expected) {
                let difference = (f64::from(average) - expected).abs();
                assert!(difference <= 0.5 + 1e-9, "{source:?} to {target:?}");
            }
        }
    }

    #[test]
    fn white_stays_white_at_any_size() {
        for (source, target) in [
            ((1921, 1079), (320, 180)),
            ((321, 1), (320, 1)),
            ((1, 5000), (1, 320)),
            ((640, 480), (320, 240)),
            // 255 times its pixels are more than 2^32.
            ((8192, 2100), (319, 82)),
        ] {
            let luma = vec![255; source.0 as usize * source.1 as usize];
            let mut averages = Vec::new();
            area_average(&luma, source, target, &mut averages);
            assert_eq!(averages.len(), target.0 as usize * target.1 as usize);
            assert!(averages.iter().all(|&value| value == 255));
        }
    }
}
