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
