//! (A) Where the discriminant sees the target among all places around the last answer.
//!
//! Particles are few, and what is between them is not seen: the further a target may have moved, the wider the gaps.
//! Areas of one size that are whole cells apart have their cells in common, though. So one grid of cells over the
//! surroundings serves all of them, and the discriminant's scores are a correlation of its weights with the grid.
//! Some of the first particles are then drawn around the best places; they are weighed as all particles are.
//!
//! A score here is not quite that of a particle at the same place: a cell at the edge of an area is normalised with
//! the cells beyond the edge as well.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::classifier::ridge::Discriminant;
use crate::tracker::classifier::sliding_window::SlidingWindow;
use crate::tracker::features::extractor::{Extractor, Grid};
use crate::tracker::linalg::scratch::clear_and_reserve;
use crate::tracker::motion::particles::Particle;
use crate::tracker::motion::proposal::SearchContext;
use crate::tracker::params::table::Features;
use crate::tracker::params::table::Params;

/// Places in each direction at most: a look further than that costs more than the rest of a step.
pub(crate) const MAX_AWAY: usize = 24;
/// Values that are multiplied at most: as many as [`MAX_AWAY`] takes with 8 x 8 cells. More cells, fewer places.
const MAX_PRODUCTS: usize = 1_600_000;

/// The scores of a frame, and room for them.
#[derive(Debug, Default)]
pub(crate) struct DenseSearch {
    grid: Grid,
    sliding_window: SlidingWindow,
    /// How likely each place is, row by row: the logarithm of what its particle's weight is multiplied with.
    values: Vec<f32>,
    /// The same without the peaks that were taken, and those.
    left: Vec<f32>,
    maxima: Vec<Particle>,
    /// Where the places are; none where nothing was looked at.
    places: Option<SampleCoords>,
}

/// Places in a row and above each other, around a center.
#[derive(Debug, Clone, Copy)]
struct SampleCoords {
    center: Particle,
    /// How far to the left of the center, and above it, the first of them is.
    away: (usize, usize),
    cell: (f64, f64),
}

impl SampleCoords {
    #[inline(always)]
    fn at(&self, column: usize, row: usize) -> Particle {
        let ((across, down), (width, height)) = (self.away, self.cell);
        Particle {
            x: self.center.x + (column as f64 - across as f64) * width,
            y: self.center.y + (row as f64 - down as f64) * height,
            ..self.center
        }
    }

    /// The value at `particle`, between those of the places around it; none beyond the last of them.
    fn value(&self, values: &[f32], particle: &Particle) -> Option<f64> {
        let ((across, down), (width, height)) = (self.away, self.cell);
        let x = (particle.x - self.center.x) / width + across as f64;
        let y = (particle.y - self.center.y) / height + down as f64;
        let (columns, rows) = (2 * across + 1, 2 * down + 1);
        let inside = |at: f64, count: usize| (0.0..(count - 1) as f64).contains(&at);
        if !inside(x, columns) || !inside(y, rows) {
            return None;
        }
        let corner = &values[y as usize * columns + x as usize..];
        let (right, below) = (x.fract(), y.fract());
        let line = |from: usize| {
            let (a, b) = (f64::from(corner[from]), f64::from(corner[from + 1]));
            a + (b - a) * right
        };
        Some(line(0) + (line(columns) - line(0)) * below)
    }
}

/// What scores of places become together with the prior, to be compiled for the instructions that this machine has.
struct Weigh<'a> {
    places: SampleCoords,
    search: &'a SearchContext<'a>,
    values: &'a mut [f32],
}

impl WithSimd for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let factor = self.search.params.discriminant_weight;
        let columns = 2 * self.places.away.0 + 1;
        for (row, values) in self.values.chunks_exact_mut(columns).enumerate() {
            for (column, value) in values.iter_mut().enumerate() {
                let likely = factor * f64::from(*value);
                let place = self.places.at(column, row);
                *value = (likely + self.search.log_displacement(&place)) as f32;
            }
        }
    }
}

impl DenseSearch {
    /// The best places, best first.
    pub fn maxima(&self) -> &[Particle] {
        &self.maxima
    }

    /// Looks at all places around the one that is sought, in what `extractor` is open on.
    pub fn look(
        &mut self,
        extractor: &mut Extractor,
        search: &SearchContext<'_>,
        discriminant: &Discriminant,
    ) {
        let params = search.params;
        self.maxima.clear();
        self.places = None;
        if params.dense_maxima == 0
            || !discriminant.is_on()
            || params.features != Features::Gradients
        {
            return;
        }
        let center = search.displaced();
        let (cell_width, cell_height) = Extractor::cell_size(&center, search.bounds, params);
        let (across, down) = places(search.scanned(), (cell_width, cell_height), params);
        extractor.grid(
            &center,
            (across, down),
            MAX_AWAY,
            search.bounds,
            params,
            &mut self.grid,
        );
        let (columns, rows) = (2 * across + 1, 2 * down + 1);
        clear_and_reserve(&mut self.values, (2 * MAX_AWAY + 1).pow(2));
        clear_and_reserve(&mut self.left, (2 * MAX_AWAY + 1).pow(2));
        self.values.resize(columns * rows, 0.0);
        let cell_pixels = (cell_width * cell_height) as f32;
        let values = &mut self.values;
        self.sliding_window
            .scores(&self.grid, discriminant, params, cell_pixels, values);
        let places = SampleCoords {
            center,
            away: (across, down),
            cell: (cell_width, cell_height),
        };
        Arch::new().dispatch(Weigh {
            places,
            search,
            values: &mut self.values,
        });
        self.places = Some(places);
        self.left.clone_from(&self.values);
        for _ in 0..params.dense_maxima {
            let Some(best) = take_maximum(&mut self.left, columns) else {
                break;
            };
            self.maxima.push(places.at(best % columns, best / columns));
        }
    }

    /// Leaves out those of the first `particles` that are hopeless: at places less likely than the best one by more than is
    /// asked for. What was last seen, there or carried along, stays, and what is out of sight may be anywhere.
    pub fn prune(&self, search: &SearchContext<'_>, particles: &mut Vec<Particle>) {
        let margin = search.params.prune_margin;
        let Some(places) = self.places else { return };
        if margin <= 0.0 || search.search_scale > 1.0 {
            return;
        }
        let most = self
            .values
            .iter()
            .copied()
            .fold(f32::NEG_INFINITY, f32::max);
        let least = f64::from(most) - margin;
        let mut index = 0;
        particles.retain(|particle| {
            index += 1;
            let value = places.value(&self.values, particle);
            index <= 2 || value.is_none_or(|value| value >= least)
        });
    }
}

/// How many places to look at to each side, and up and down, to get `away` working pixels far.
fn places(away: f64, (cell_width, cell_height): (f64, f64), params: &Params) -> (usize, usize) {
    let [mut across, mut down] =
        [cell_width, cell_height].map(|cell| ((away / cell).ceil() as usize).min(MAX_AWAY));
    let len = params.feature_len();
    while (2 * across + 1) * (2 * down + 1) * len > MAX_PRODUCTS && across.max(down) > 0 {
        (across, down) = (across.saturating_sub(1), down.saturating_sub(1));
    }
    (across, down)
}

/// The index of the greatest value; it and those beside it count no more.
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
    use crate::tracker::image::frame::GrayFrame;
    use crate::tracker::motion::particles::StateBounds;
    use crate::tracker::params::presets::Preset;

    fn frame() -> GrayFrame {
        let luma = (0..160 * 120).map(|i| ((i * i / 7 + i / 160 * 13 + i) % 251) as u8);
        GrayFrame::from_luma(160, 120, luma.collect()).expect("a frame of this size")
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
        extractor.grid(&center, (2, 1), MAX_AWAY, &bounds, &params, &mut grid);
        assert_eq!(grid.columns, 12);
        assert_eq!(grid.grays.len(), 120);
        let mut alone = Grid::default();
        extractor.grid(&center, (0, 0), MAX_AWAY, &bounds, &params, &mut alone);
        for (index, gray) in alone.grays.iter().enumerate() {
            let on_grid = grid.grays[(1 + index / 8) * 12 + 2 + index % 8];
            assert!(
                (gray - on_grid).abs() < 1e-2 * gray.abs().max(1.0),
                "{gray} {on_grid}"
            );
        }
    }

    #[test]
    fn a_value_between_places_is_that_of_a_plane_and_there_is_none_beyond() {
        let center = Particle {
            x: 50.0,
            y: 40.0,
            scale: 1.0,
        };
        let places = SampleCoords {
            center,
            away: (3, 2),
            cell: (4.0, 5.0),
        };
        let plane = |place: &Particle| 2.0 * place.x - 3.0 * place.y + 7.0;
        let values: Vec<f32> = (0..35)
            .map(|i| plane(&places.at(i % 7, i / 7)) as f32)
            .collect();
        for (x, y) in [(50.0, 40.0), (38.0, 30.0), (43.7, 48.9), (61.9, 31.2)] {
            let particle = Particle { x, y, ..center };
            let value = places.value(&values, &particle);
            let value = value.expect("it is among the places");
            assert!((value - plane(&particle)).abs() < 1e-4, "{x} {y}: {value}");
        }
        for (x, y) in [(37.9, 40.0), (62.1, 40.0), (50.0, 29.9), (50.0, 50.1)] {
            let particle = Particle { x, y, ..center };
            assert_eq!(places.value(&values, &particle), None, "{x} {y}");
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
