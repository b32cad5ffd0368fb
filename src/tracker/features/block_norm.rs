//! Histograms of gradient directions: what the directions of a cell are divided by.
//!
//! The energy of a cell is the sum of the squares of its directions. Each cell is brought to a scale by the root of the
//! mean energy of the 3 x 3 cells around it, so that contrast is taken out where it is.

use pulp::Simd;

/// Cells of a row that are worked on together.
const GROUP: usize = 8;

/// The energies of the cells of one area.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockNorm {
    columns: usize,
    /// Row by row.
    values: Vec<f32>,
    /// The sums of each cell and those above and below it, row by row: a zero, those of the cells of a row, and zeros up
    /// to a whole number of groups and one more.
    columns_of_three: Vec<f32>,
    /// For each column one over the number of cells beside it in a row, itself among them; the same for each row.
    column_shares: Vec<f32>,
    row_shares: Vec<f32>,
    /// What the directions of each cell are multiplied by: rows of whole groups.
    scales: Vec<f32>,
}

impl BlockNorm {
    /// Makes room for so many columns and rows of cells.
    pub fn prepare(&mut self, columns: usize, rows: usize) {
        self.columns = columns;
        let padded = columns.next_multiple_of(GROUP);
        let zeros = |values: &mut Vec<f32>, count: usize| {
            values.clear();
            values.resize(count, 0.0);
        };
        zeros(&mut self.values, columns * rows);
        zeros(&mut self.columns_of_three, (padded + 2) * rows);
        zeros(&mut self.scales, padded * rows);
        let share = |i: usize, count: usize| {
            let beside = (i + 2).min(count) - i.saturating_sub(1);
            1.0 / beside as f32
        };
        self.column_shares.clear();
        self.column_shares
            .extend((0..columns).map(|i| share(i, columns)));
        self.column_shares.resize(padded, 0.0);
        self.row_shares.clear();
        self.row_shares.extend((0..rows).map(|j| share(j, rows)));
    }

    /// Takes the energies of the cells from column `first` of row `row` on, each the sum of a register.
    #[inline(always)]
    pub fn take<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        (first, row): (usize, usize),
        energies: [S::f32s; N],
    ) {
        let out = &mut self.values[row * self.columns + first..][..N];
        for (out, energy) in out.iter_mut().zip(energies) {
            *out = simd.reduce_sum_f32s(energy);
        }
    }

    /// Adds to each energy those above and below it, once all are taken.
    #[inline(always)]
    pub fn sum_columns(&mut self) {
        let (columns, last) = (self.columns, self.row_shares.len() - 1);
        let padded = self.column_shares.len();
        let sums = self.columns_of_three.chunks_exact_mut(padded + 2);
        for (row, sums) in sums.enumerate() {
            // A row at the edge has itself in place of what is beyond, times nothing.
            let (above, below) = (row.saturating_sub(1), (row + 1).min(last));
            let (has_above, has_below) = (share_of(above < row), share_of(below > row));
            let values = |row: usize| self.values[row * columns..][..columns].as_chunks::<GROUP>();
            let (above, here, below) = (values(above), values(row), values(below));
            let (sums, rest) = sums[1..=columns].as_chunks_mut::<GROUP>();
            for (((above, here), below), sums) in above.0.iter().zip(here.0).zip(below.0).zip(sums)
            {
                let mut sum = *here;
                for lane in 0..GROUP {
                    sum[lane] += has_above * above[lane] + has_below * below[lane];
                }
                *sums = sum;
            }
            for (((above, here), below), sum) in above.1.iter().zip(here.1).zip(below.1).zip(rest) {
                *sum = here + has_above * above + has_below * below;
            }
        }
    }

    /// What the directions of each cell are multiplied by, a row after the other: one over three times the root of the
    /// mean energy around, `floor` added to it. Reads the sums in another width than they are written in, which is slow
    /// just after that.
    #[inline(always)]
    pub fn scales(&mut self, floor: f32) -> impl Iterator<Item = &[f32]> {
        let (columns, padded) = (self.columns, self.column_shares.len());
        let rows = self.scales.chunks_exact_mut(padded).zip(&self.row_shares);
        let sums = self.columns_of_three.chunks_exact(padded + 2);
        for ((scales, &row_share), sums) in rows.zip(sums) {
            let groups = scales.as_chunks_mut::<GROUP>().0;
            let shares = self.column_shares.as_chunks::<GROUP>().0;
            for (group, (scales, shares)) in groups.iter_mut().zip(shares).enumerate() {
                let mut mean = [0.0; GROUP];
                for shift in 0..3 {
                    let part = &sums[group * GROUP + shift..][..GROUP];
                    for lane in 0..GROUP {
                        mean[lane] += part[lane];
                    }
                }
                for lane in 0..GROUP {
                    mean[lane] = mean[lane] * row_share * shares[lane] + floor;
                }
                for mean in &mut mean {
                    *mean = 1.0 / (3.0 * mean.sqrt());
                }
                *scales = mean;
            }
        }
        self.scales
            .chunks_exact(padded)
            .map(move |row| &row[..columns])
    }
}

/// 1 or 0.
#[inline(always)]
fn share_of(counts: bool) -> f32 {
    if counts { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_those_of_the_mean_energy_around() {
        for (columns, rows) in [(4, 4), (8, 8), (5, 7), (17, 4)] {
            let energy = |i: usize| (i * 37 % 23) as f32;
            let mut energies = BlockNorm::default();
            energies.prepare(columns, rows);
            for (i, value) in energies.values[..columns * rows].iter_mut().enumerate() {
                *value = energy(i);
            }
            energies.sum_columns();
            for (j, found) in energies.scales(5.0).enumerate() {
                assert_eq!(found.len(), columns);
                for (i, found) in found.iter().enumerate() {
                    let beside = |at: &usize| {
                        (at % columns).abs_diff(i) <= 1 && (at / columns).abs_diff(j) <= 1
                    };
                    let around: Vec<usize> = (0..columns * rows).filter(beside).collect();
                    let sum: f32 = around.iter().map(|&at| energy(at)).sum();
                    let expected = 1.0 / (3.0 * (sum / around.len() as f32 + 5.0).sqrt());
                    assert!(
                        (found - expected).abs() < 1e-5 * expected,
                        "{found} {expected}"
                    );
                }
            }
        }
    }
}
