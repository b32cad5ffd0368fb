//! The block normalisation of a gradient histogram: the factor of each cell's directions.
//!
//! The energy of a cell is the sum of the squares of its directions. A cell is divided by three times the root of the
//! mean energy of the 3 x 3 cells around it, which takes local contrast out. At the rim of the area the mean is over
//! those of the nine cells that exist.

use pulp::Simd;

/// Cells of a row that are computed together.
const GROUP: usize = 8;

/// The energies of the cells of one area.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockNorm {
    columns: usize,
    /// The energy of each cell, row by row.
    energies: Vec<f32>,
    /// The energy of each cell plus those above and below it. A row is a zero, its cells, zeros up to a whole number of
    /// groups, and another zero.
    vertical_sums: Vec<f32>,
    /// 1 over the number of columns, and of rows, in the block around a cell.
    column_weights: Vec<f32>,
    row_weights: Vec<f32>,
    /// The factor of each cell, in rows of whole groups.
    factors: Vec<f32>,
}

impl BlockNorm {
    /// Makes room for so many columns and rows of cells.
    pub fn resize(&mut self, columns: usize, rows: usize) {
        self.columns = columns;
        let padded = columns.next_multiple_of(GROUP);
        let zeros = |values: &mut Vec<f32>, count: usize| {
            values.clear();
            values.resize(count, 0.0);
        };
        zeros(&mut self.energies, columns * rows);
        zeros(&mut self.vertical_sums, (padded + 2) * rows);
        zeros(&mut self.factors, padded * rows);
        let weight =
            |i: usize, count: usize| 1.0 / ((i + 2).min(count) - i.saturating_sub(1)) as f32;
        self.column_weights.clear();
        self.column_weights
            .extend((0..columns).map(|i| weight(i, columns)));
        self.column_weights.resize(padded, 0.0);
        self.row_weights.clear();
        self.row_weights.extend((0..rows).map(|j| weight(j, rows)));
    }

    /// Sets the energies of the cells from column `first` of row `row` on, each the sum over a register.
    #[inline(always)]
    pub fn set_energies<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        (first, row): (usize, usize),
        energies: [S::f32s; N],
    ) {
        let out = &mut self.energies[row * self.columns + first..][..N];
        for (energy, out) in energies.iter().zip(out) {
            *out = simd.reduce_sum_f32s(*energy);
        }
    }

    /// Adds to each energy those above and below it. All energies must have been set.
    #[inline(always)]
    pub fn sum_vertically(&mut self) {
        let (columns, last) = (self.columns, self.row_weights.len() - 1);
        let padded = self.column_weights.len();
        let sums = self.vertical_sums.chunks_exact_mut(padded + 2);
        for (row, sums) in sums.enumerate() {
            // At the rim the row itself stands in for the missing one, times 0.
            let (above, below) = (row.saturating_sub(1), (row + 1).min(last));
            let (has_above, has_below) = (f32::from(above < row), f32::from(below > row));
            let energies =
                |row: usize| self.energies[row * columns..][..columns].as_chunks::<GROUP>();
            let (above, here, below) = (energies(above), energies(row), energies(below));
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

    /// The factors of the cells' directions, row by row: 1 / (3 √(mean energy around + `floor`)). Slow just after
    /// [`sum_vertically`](Self::sum_vertically), whose sums it reads in another width than they were written in.
    #[inline(always)]
    pub fn factors(&mut self, floor: f32) -> impl Iterator<Item = &[f32]> {
        let (columns, padded) = (self.columns, self.column_weights.len());
        let rows = self.factors.chunks_exact_mut(padded).zip(&self.row_weights);
        let sums = self.vertical_sums.chunks_exact(padded + 2);
        for ((factors, &row_weight), sums) in rows.zip(sums) {
            let groups = factors.as_chunks_mut::<GROUP>().0;
            let weights = self.column_weights.as_chunks::<GROUP>().0;
            for (group, (factors, weights)) in groups.iter_mut().zip(weights).enumerate() {
                let mut mean = [0.0; GROUP];
                for shift in 0..3 {
                    let part = &sums[group * GROUP + shift..][..GROUP];
                    for lane in 0..GROUP {
                        mean[lane] += part[lane];
                    }
                }
                for lane in 0..GROUP {
                    mean[lane] = mean[lane] * row_weight * weights[lane] + floor;
                }
                for mean in &mut mean {
                    *mean = 1.0 / (3.0 * mean.sqrt());
                }
                *factors = mean;
            }
        }
        self.factors
            .chunks_exact(padded)
            .map(move |row| &row[..columns])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_of_the_mean_energy_around() {
        for (columns, rows) in [(4, 4), (8, 8), (5, 7), (17, 4)] {
            let energy = |i: usize| (i * 37 % 23) as f32;
            let mut norm = BlockNorm::default();
            norm.resize(columns, rows);
            for (i, value) in norm.energies[..columns * rows].iter_mut().enumerate() {
                *value = energy(i);
            }
            norm.sum_vertically();
            for (j, found) in norm.factors(5.0).enumerate() {
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
