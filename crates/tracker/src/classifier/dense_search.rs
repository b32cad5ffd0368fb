//! Dense search: the discriminant's scores at every place around the last answer, a cell apart.
//!
//! Particles are few, and what is between them is not seen: the further a target may have moved, the wider the gaps.
//! Areas of one size that are whole cells apart share their cells, so one grid of cells serves all of them, and the
//! scores are a correlation of the discriminant's weights with the grid
//! ([`sliding_window`](crate::classifier::sliding_window)). Half of the first particles are then drawn around the
//! maxima, and weighed as all particles are.
//!
//! A score here differs a little from that of a particle at the same place: a cell at the edge of an area is normalised
//! with the cells beyond the edge as well.

use pulp::{Arch, Simd};

use crate::appearance::foreground_map::ForegroundMap;
use crate::classifier::channel_planes::{ChannelPlanes, MAX_OFFSET};
use crate::classifier::ridge::Discriminant;
use crate::classifier::sliding_window::window_scores;
use crate::features::extractor::{Extractor, Grid};
use crate::linalg::scratch::clear_and_reserve;
use crate::motion::particles::Particle;
use crate::motion::search::{MAX_PRIOR_WIDTH, SearchContext};
use crate::params::table::{Features, Params};

/// Multiplications of a dense search at most: with 8 x 8 cells enough for 45 x 45 places.
const MAX_PRODUCTS: usize = 1_600_000;

/// The dense search of a frame, and its buffers.
#[derive(Debug, Default)]
pub(crate) struct DenseSearch {
    grid: Grid,
    planes: ChannelPlanes,
    /// The logarithm of what the weight of a particle at each place is multiplied by, row by row.
    values: Vec<f32>,
    /// The local maxima, best first.
    pub maxima: Vec<Particle>,
}

/// The places of a dense search: a grid around a center.
#[derive(Debug, Clone, Copy)]
struct SearchGrid {
    center: Particle,
    /// How many places there are on each side of the center: left and right, above and below.
    offset: (usize, usize),
    /// The distance of two neighbours, in working pixels.
    cell: (f64, f64),
}

impl SearchGrid {
    /// The grid around `center` that reaches `radius` working pixels far, or as far as a dense search may.
    fn new(center: Particle, radius: f64, cell: (f64, f64), params: &Params) -> Self {
        let [mut across, mut down] =
            [cell.0, cell.1].map(|side| ((radius / side).ceil() as usize).min(MAX_OFFSET));
        let len = params.feature_len();
        while (2 * across + 1) * (2 * down + 1) * len > MAX_PRODUCTS && across.max(down) > 0 {
            (across, down) = (across.saturating_sub(1), down.saturating_sub(1));
        }
        let offset = (across, down);
        Self {
            center,
            offset,
            cell,
        }
    }

    fn columns(&self) -> usize {
        2 * self.offset.0 + 1
    }

    #[inline(always)]
    fn at(&self, column: usize, row: usize) -> Particle {
        Particle {
            x: self.center.x + (column as f64 - self.offset.0 as f64) * self.cell.0,
            y: self.center.y + (row as f64 - self.offset.1 as f64) * self.cell.1,
            ..self.center
        }
    }
}

/// Turns the scores in `values` into logarithms of weights.
#[pulp::with_simd(weigh = Arch::new())]
#[inline(always)]
fn weigh_simd<S: Simd>(
    _: S,
    places: &SearchGrid,
    search: &SearchContext<'_>,
    foreground: &ForegroundMap,
    values: &mut [f32],
) {
    let (weight, bounds) = (search.params.discriminant_weight, search.bounds);
    let rows = values.chunks_exact_mut(places.columns());
    for (row, values) in rows.enumerate() {
        for (column, value) in values.iter_mut().enumerate() {
            let place = places.at(column, row);
            let color = foreground.mean(&place, place.scale, bounds);
            let prior =
                search.log_prior(&place, MAX_PRIOR_WIDTH) + search.params.histogram_weight * color;
            *value = (weight * f64::from(*value) + prior) as f32;
        }
    }
}

impl DenseSearch {
    /// Scores all places around the last answer, displaced with the image, in the channels that `extractor` has
    /// computed, and finds the maxima.
    pub fn run(
        &mut self,
        extractor: &mut Extractor,
        search: &SearchContext<'_>,
        discriminant: &Discriminant,
        foreground: &ForegroundMap,
    ) {
        let (params, bounds) = (search.params, search.bounds);
        self.maxima.clear();
        let has_gradients = params.features == Features::Gradients;
        if params.dense_maxima == 0 || !discriminant.is_on() || !has_gradients {
            return;
        }
        let center = search.displaced();
        let cell = Extractor::cell_size(&center, bounds, params);
        let places = SearchGrid::new(center, search.dense_radius(), cell, params);
        let grid = &mut self.grid;
        extractor.grid(&center, places.offset, MAX_OFFSET, bounds, params, grid);
        clear_and_reserve(&mut self.values, (2 * MAX_OFFSET + 1).pow(2));
        let values = &mut self.values;
        values.resize(places.columns() * (2 * places.offset.1 + 1), 0.0);
        let cell_pixels = (cell.0 * cell.1) as f32;
        let size = (params.patch_width as usize, params.patch_height as usize);
        let planes = &mut self.planes;
        window_scores(planes, grid, discriminant, size, cell_pixels, values);
        weigh(&places, search, foreground, values);
        let columns = places.columns();
        while self.maxima.len() < params.dense_maxima as usize {
            let Some(index) = take_maximum(values, columns) else {
                break;
            };
            self.maxima
                .push(places.at(index % columns, index / columns));
        }
    }
}

/// The index of the greatest value. It and its neighbours are removed.
fn take_maximum(values: &mut [f32], columns: usize) -> Option<usize> {
    // In parts so that the loop vectorises.
    let mut parts = [f32::NEG_INFINITY; 16];
    for chunk in values.chunks(parts.len()) {
        for (most, value) in parts.iter_mut().zip(chunk) {
            *most = if *value > *most { *value } else { *most };
        }
    }
    let most = parts.into_iter().fold(f32::NEG_INFINITY, f32::max);
    if most == f32::NEG_INFINITY {
        return None;
    }
    let best = values.iter().position(|&value| value == most)?;
    let (column, row) = (best % columns, best / columns);
    let rows = values.chunks_exact_mut(columns);
    for row in rows.skip(row.saturating_sub(1)).take(3.min(row + 2)) {
        let last = (column + 1).min(columns - 1);
        row[column.saturating_sub(1)..=last].fill(f32::NEG_INFINITY);
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::frame::Frame;
    use crate::motion::particles::StateBounds;
    use crate::params::presets::Preset;

    fn frame() -> Frame {
        let luma = (0..160 * 120).map(|i| ((i * i / 7 + i / 160 * 13 + i) % 251) as u8);
        Frame::from_luma(160, 120, luma.collect()).expect("a frame of this size")
    }

    /// The cells of a grid are those of areas, but for the edges.
    #[test]
    fn a_grid_has_the_gray_values_of_its_areas() {
        let params = Preset::Robust.params();
        let bounds = StateBounds {
            frame_width: 160.0,
            frame_height: 120.0,
            box_width: 32.0,
            box_height: 24.0,
        };
        let center = Particle {
            x: 80.0,
            y: 60.0,
            scale: 1.0,
        };
        let mut extractor = Extractor::default();
        extractor.compute_channels(&frame(), &[center], 40.0, &bounds, &params);
        let mut grid = Grid::default();
        extractor.grid(&center, (2, 1), MAX_OFFSET, &bounds, &params, &mut grid);
        assert_eq!(grid.columns, 12);
        assert_eq!(grid.grays.len(), 120);
        let mut alone = Grid::default();
        extractor.grid(&center, (0, 0), MAX_OFFSET, &bounds, &params, &mut alone);
        for (index, gray) in alone.grays.iter().enumerate() {
            let on_grid = grid.grays[(1 + index / 8) * 12 + 2 + index % 8];
            assert!(
                (gray - on_grid).abs() < 1e-2 * gray.abs().max(1.0),
                "{gray} {on_grid}"
            );
        }
    }

    #[test]
    fn peaks_are_taken_best_first_and_not_side_by_side() {
        let mut values = vec![0.0_f32; 35];
        for (index, value) in [(8, 5.0), (9, 4.0), (1, 4.5), (20, 3.0), (34, 2.0)] {
            values[index] = value;
        }
        let maxima: Vec<_> = (0..3).map(|_| take_maximum(&mut values, 7)).collect();
        assert_eq!(maxima, [Some(8), Some(20), Some(34)]);
        values.fill(f32::NEG_INFINITY);
        assert_eq!(take_maximum(&mut values, 7), None);
    }
}
