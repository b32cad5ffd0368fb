//! Exact area averaging, in integers.
//!
//! An output pixel of index `o` covers the source interval `[o * S / T, (o + 1) * S / T)` for source size `S` and
//! target size `T`. Measured in units of `1 / T` of a source pixel every interval has the whole length `S`, and
//! its shares of source pixels are whole numbers too, so the average is exact up to the final rounding.

/// The share of one source index in one or two neighbouring target indices, in units of `1 / target`.
struct Share {
    target: usize,
    first: u32,
    second: u32,
}

/// How each of `source` indices is shared among `target` indices, `target <= source`.
fn shares(source: u32, target: u32) -> Vec<Share> {
    (0..u64::from(source))
        .map(|index| {
            let (source, target) = (u64::from(source), u64::from(target));
            let begin = index * target;
            let owner = begin / source;
            let edge = (owner + 1) * source;
            let first = target.min(edge - begin);
            Share {
                target: owner as usize,
                first: first as u32,
                second: (target - first) as u32,
            }
        })
        .collect()
}

/// The area average of `luma` (`source` = width, height, row order) on a grid of `target` = width, height, where
/// no target side is above its source side.
pub(super) fn area_average(luma: &[u8], source: (u32, u32), target: (u32, u32)) -> Vec<u8> {
    let columns = shares(source.0, target.0);
    let rows = shares(source.1, target.1);
    let mut out = Vec::with_capacity(target.0 as usize * target.1 as usize);
    // Rows first: that loop runs over every source pixel, and this way it is contiguous. 255 times the weights
    // of a column, which sum to the source height, stays far below 2^32 for any image that fits into memory.
    let mut sums = vec![0_u32; source.0 as usize];
    let mut next_sums = vec![0_u32; source.0 as usize];
    let mut cells = vec![0_u64; target.0 as usize + 1];
    let full = u64::from(source.0) * u64::from(source.1);
    for (index, row) in luma.chunks_exact(source.0 as usize).enumerate() {
        let share = &rows[index];
        for (sum, &value) in sums.iter_mut().zip(row) {
            *sum += u32::from(value) * share.first;
        }
        if share.second > 0 {
            for (sum, &value) in next_sums.iter_mut().zip(row) {
                *sum += u32::from(value) * share.second;
            }
        }
        let last_of_cell = rows
            .get(index + 1)
            .is_none_or(|next| next.target > share.target);
        if last_of_cell {
            cells.fill(0);
            for (&sum, column) in sums.iter().zip(&columns) {
                cells[column.target] += u64::from(sum) * u64::from(column.first);
                cells[column.target + 1] += u64::from(sum) * u64::from(column.second);
            }
            let averages = cells[..target.0 as usize].iter();
            out.extend(averages.map(|&sum| ((sum + full / 2) / full) as u8));
            std::mem::swap(&mut sums, &mut next_sums);
            next_sums.fill(0);
        }
    }
    out
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
            let averages = area_average(&luma, source, target);
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
        for source in [(1921, 1079), (321, 1), (1, 5000), (640, 480)] {
            let luma = vec![255; source.0 as usize * source.1 as usize];
            let target = crate::tracker::frame::working_size(source.0, source.1);
            let averages = area_average(&luma, source, target);
            assert_eq!(averages.len(), target.0 as usize * target.1 as usize);
            assert!(averages.iter().all(|&value| value == 255));
        }
    }
}
