//! Exact area averaging, in integers.
//!
//! Along each axis, target pixel `o` covers the source interval `[o * S / T, (o + 1) * S / T)` for source size `S` and
//! target size `T`. In units of `1 / T` source pixel every interval has the length `S`, and its shares of source pixels
//! are whole numbers too. So the average is exact up to the final rounding.

use pulp::{Arch, Simd};

/// Added to a number below 2^51, it leaves the nearest whole number in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

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
    let is_whole = source.0.is_multiple_of(target.0);
    let boundaries = boundaries(source.0, target.0);
    let mut integral = Vec::new();
    let width = source.0 as usize;
    out.reserve_exact(target.0 as usize * target.1 as usize);
    // Rows first: that loop runs over every source pixel, and this way it is contiguous. A column's weights sum to the
    // source height; 255 times that stays far below 2^32 for any image that fits into memory.
    let mut sums = vec![0_u32; width + 1];
    for cell in cells(source.1, target.1) {
        sums.fill(0);
        let first = cell.begin - usize::from(cell.before > 0);
        let end = cell.end + usize::from(cell.after > 0);
        let row = |index: usize| &luma[index * width..][..width];
        let share = |index: usize| match index {
            _ if index >= end => 0,
            _ if index < cell.begin => cell.before,
            _ if index >= cell.end => cell.after,
            _ => target.1,
        };
        // Two at a time, so that sums are loaded and stored half as often.
        for index in (first..end).step_by(2) {
            let next = index + 1;
            let rows = row(index).iter().zip(row(next.min(end - 1)));
            let shares = [share(index), share(next)];
            for (sum, (&one, &other)) in sums.iter_mut().zip(rows) {
                *sum += u32::from(one) * shares[0] + u32::from(other) * shares[1];
            }
        }
        match source.0 / target.0 {
            2 if is_whole => average_whole::<2>(&sums, source.1, out),
            3 if is_whole => average_whole::<3>(&sums, source.1, out),
            4 if is_whole => average_whole::<4>(&sums, source.1, out),
            6 if is_whole => average_whole::<6>(&sums, source.1, out),
            _ => average_row(&sums, &boundaries, source, &mut integral, out),
        }
    }
}

/// Where each target pixel begins, and where the last one ends: a source column, and how much of it lies before, in
/// units of `1 / T`.
fn boundaries(source: u32, target: u32) -> Vec<(u32, u32)> {
    let (source, target) = (u64::from(source), u64::from(target));
    (0..=target)
        .map(|index| index * source)
        .map(|at| ((at / target) as u32, (at % target) as u32))
        .collect()
}

/// Appends the averages of one row of target pixels, from the sums of its source columns and a zero. The loops have no
/// branches: how many columns a target pixel covers changes from one to the next. `integral` is a buffer.
#[inline(always)]
fn average_row(
    sums: &[u32],
    boundaries: &[(u32, u32)],
    source: (u32, u32),
    integral: &mut Vec<i64>,
    out: &mut Vec<u8>,
) {
    let target = boundaries.len() - 1;
    let mut total = 0;
    integral.resize(sums.len(), 0);
    for (before, &sum) in integral.iter_mut().zip(sums) {
        *before = total;
        total += i64::from(sum);
    }
    let divisor = Divisor::new(u64::from(source.0) * u64::from(source.1));
    let first = out.len();
    out.resize(first + target, 0);
    let mut begin = 0;
    for (average, &(column, part)) in out[first..].iter_mut().zip(&boundaries[1..]) {
        let before = integral[column as usize] * target as i64;
        // In units of `1 / T`. A signed number becomes a floating-point one in one instruction.
        let end = before + i64::from(sums[column as usize]) * i64::from(part);
        *average = divisor.rounded((end - begin) as f64);
        begin = end;
    }
}

/// As [`average_row`], where a target pixel is `WIDTH` whole columns, as for the usual sizes of video.
#[inline(always)]
fn average_whole<const WIDTH: usize>(sums: &[u32], height: u32, out: &mut Vec<u8>) {
    let divisor = Divisor::new(WIDTH as u64 * u64::from(height));
    let cells = sums.as_chunks::<WIDTH>().0;
    out.extend(
        cells
            .iter()
            .map(|cell| divisor.rounded(f64::from(cell.iter().sum::<u32>()))),
    );
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

    /// The nearest whole number to the quotient, the larger of two; `value` is a whole number. As long as the divisor is
    /// below 2^40, what is added to the value outweighs the rounding, and does not reach the next quotient.
    #[inline(always)]
    fn rounded(&self, value: f64) -> u8 {
        ((value + 0.25) * self.inverse + ROUND).to_bits() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by the definition: overlaps of intervals, in floating point.
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
        ] {
            let luma = vec![255; source.0 as usize * source.1 as usize];
            let mut averages = Vec::new();
            area_average(&luma, source, target, &mut averages);
            assert_eq!(averages.len(), target.0 as usize * target.1 as usize);
            assert!(averages.iter().all(|&value| value == 255));
        }
    }
}
