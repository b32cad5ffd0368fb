//! Histograms of gradient directions: what the directions of a cell are divided by.
//!
//! The energy of a cell is the sum of the squares of its directions. Each cell is brought to a scale by the root of the
//! mean energy of the 3 x 3 cells around it, so that contrast is taken out where it is.

use super::gradients::DIRECTIONS;

/// Cells of a row that are worked on together.
const GROUP: usize = 8;

/// The energies of the cells of one area.
#[derive(Debug, Clone, Default)]
pub(super) struct Energies {
    /// Row by row, with a rim of zeros around: rows of `stride` values.
    values: Vec<f32>,
    stride: usize,
    /// For each column one over the number of cells beside it in a row, itself among them; the same for each row.
    column_shares: Vec<f32>,
    row_shares: Vec<f32>,
    /// What the directions of each cell of a row are multiplied by.
    scales: Vec<f32>,
}

impl Energies {
    /// Makes room for so many columns and rows of cells.
    pub fn prepare(&mut self, columns: usize, rows: usize) {
        let padded = columns.next_multiple_of(GROUP);
        self.stride = padded + 2;
        self.values.clear();
        self.values.resize(self.stride * (rows + 2), 0.0);
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
        self.scales.resize(padded, 0.0);
    }

    /// Takes the cells of row `row`.
    #[inline(always)]
    pub fn take(&mut self, row: usize, cells: &[[f32; 16]]) {
        let values = &mut self.values[(row + 1) * self.stride + 1..];
        for (value, cell) in values.iter_mut().zip(cells) {
            *value = energy(cell);
        }
    }

    /// What the directions of each cell of row `row` are multiplied by: one over three times the root of the mean energy
    /// around, `floor` added to it.
    #[inline(always)]
    pub fn scales(&mut self, row: usize, floor: f32) -> &[f32] {
        let around = &self.values[row * self.stride..][..3 * self.stride];
        let row_share = self.row_shares[row];
        let groups = self.scales.as_chunks_mut::<GROUP>().0;
        let shares = self.column_shares.as_chunks::<GROUP>().0;
        for (group, (scales, shares)) in groups.iter_mut().zip(shares).enumerate() {
            let mut energy = [0.0; GROUP];
            for row in 0..3 {
                for column in 0..3 {
                    let part = &around[row * self.stride + group * GROUP + column..][..GROUP];
                    for lane in 0..GROUP {
                        energy[lane] += part[lane];
                    }
                }
            }
            for lane in 0..GROUP {
                let mean = energy[lane] * row_share * shares[lane];
                scales[lane] = 1.0 / (3.0 * (mean + floor).sqrt());
            }
        }
        &self.scales
    }
}

/// The sum of the squares of a cell's directions.
#[inline(always)]
fn energy(cell: &[f32; 16]) -> f32 {
    let mut squares = [0.0; 8];
    for lane in 0..8 {
        squares[lane] = cell[lane] * cell[lane];
    }
    let mut pairs = [0.0; 4];
    for lane in 0..4 {
        pairs[lane] = squares[lane] + squares[lane + 4];
    }
    let last = cell[DIRECTIONS - 1];
    (pairs[0] + pairs[2]) + (pairs[1] + pairs[3]) + last * last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_those_of_the_mean_energy_around() {
        for (columns, rows) in [(4, 4), (8, 8), (5, 7), (17, 4)] {
            let value = |i: usize, lane: usize| ((i * 37 + lane * 11) % 23) as f32 - 7.0;
            let mut cells = vec![[0.0; 16]; columns * rows];
            for (i, cell) in cells.iter_mut().enumerate() {
                for (lane, channel) in cell.iter_mut().enumerate() {
                    *channel = value(i, lane);
                }
            }
            let mut energies = Energies::default();
            energies.prepare(columns, rows);
            for (j, cells) in cells.chunks_exact(columns).enumerate() {
                energies.take(j, cells);
            }
            for j in 0..rows {
                let found = energies.scales(j, 5.0)[..columns].to_vec();
                for (i, found) in found.iter().enumerate() {
                    let beside = |at: &usize| {
                        (at % columns).abs_diff(i) <= 1 && (at / columns).abs_diff(j) <= 1
                    };
                    let around: Vec<usize> = (0..columns * rows).filter(beside).collect();
                    let squares =
                        |at: usize| (0..DIRECTIONS).map(move |lane| value(at, lane).powi(2));
                    let sum: f32 = around.iter().flat_map(|&at| squares(at)).sum();
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
