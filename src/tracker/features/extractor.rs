//! From particles to the feature vectors of what is seen there, whichever features the parameters ask for.
//!
//! A view is open on one frame, around one place: what lies further off is not there.

use crate::tracker::features::centering::Centering;
use crate::tracker::features::gray::GrayPatches;
use crate::tracker::features::hog::{CHANNELS, Hog};
use crate::tracker::features::integral::{DIRECTIONS, IntegralChannels};
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;
use crate::tracker::linalg::scratch::clear_and_reserve;
use crate::tracker::motion::particles::{Particle, StateBounds};
use crate::tracker::params::table::Features;
use crate::tracker::params::table::Params;
use crate::tracker::scale::pyramid;

/// How much larger than the largest particle the areas of a frame may be: scales change by a few hundredths a frame.
const SCALE_MARGIN: f64 = 1.08;

/// Cuts feature vectors out of one frame.
#[derive(Debug, Default)]
pub(crate) struct Extractor {
    cutter: GrayPatches,
    /// Working pixels along a pixel of the frame's.
    downsample: f64,
    gradients: IntegralChannels,
    cells: Hog,
    /// Those of a grid.
    grid_cells: Hog,
}

/// The cells of a place and its surroundings, row by row.
#[derive(Debug, Default)]
pub(crate) struct Grid {
    pub columns: usize,
    /// The channels of each cell; in place of the gray value 0.
    pub values: Vec<f32>,
    /// The gray value of each cell, summed over its pixels.
    pub grays: Vec<f32>,
}

impl Extractor {
    /// What is looked at for the areas of `particles`, of which there is one, and for others up to `radius` working pixels
    /// from one of these and [`SCALE_MARGIN`] than the largest.
    pub fn window(
        particles: &[Particle],
        radius: f64,
        bounds: &StateBounds,
        params: &Params,
    ) -> Rect {
        let mut largest = particles[0];
        let (mut left, mut right) = (largest.x, largest.x);
        let (mut top, mut bottom) = (largest.y, largest.y);
        for particle in particles {
            (left, right) = (left.min(particle.x), right.max(particle.x));
            (top, bottom) = (top.min(particle.y), bottom.max(particle.y));
            largest.scale = largest.scale.max(particle.scale);
        }
        let area = seen(&largest, bounds, params);
        // A pyramid is of the box alone, without its context.
        let larger = SCALE_MARGIN.max(pyramid::largest() / params.context);
        let (width, height) = (larger * area.width, larger * area.height);
        Rect::new(
            left - radius - width / 2.0,
            top - radius - height / 2.0,
            right - left + 2.0 * radius + width,
            bottom - top + 2.0 * radius + height,
        )
    }

    /// Gets ready for the areas in the [`window`](Self::window).
    pub fn compute_channels(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        radius: f64,
        bounds: &StateBounds,
        params: &Params,
    ) {
        self.downsample = frame.downsample();
        if params.features == Features::Gradients {
            let window = Self::window(particles, radius, bounds, params);
            // One size of cells for all: the first particle is the last answer.
            let (width, height) = Self::cell(&particles[0], bounds, params);
            let cell = (width / self.downsample, height / self.downsample);
            self.gradients
                .compute(frame, &window.in_pixels_of(self.downsample), cell);
        }
    }

    /// Makes `out` the feature vectors, of length D, of `particles`.
    pub fn features(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        bounds: &StateBounds,
        params: &Params,
        out: &mut Vec<f32>,
    ) {
        out.resize(particles.len() * params.feature_len(), 0.0);
        self.describe(frame, particles, bounds, params, out, None);
    }

    /// Writes the feature vectors, of length D, of `particles` to `out`, which is as long as they are; centered, if that is
    /// asked for.
    pub fn describe(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        bounds: &StateBounds,
        params: &Params,
        out: &mut [f32],
        centering: Option<Centering<'_>>,
    ) {
        match params.features {
            Features::Gray => {
                self.cut(frame, particles, bounds, params, out);
                if let Some(centering) = centering {
                    centering.apply_to_all(out, params.feature_len());
                }
            }
            Features::Gradients => {
                let downsample = self.downsample;
                let areas = particles
                    .iter()
                    .map(|particle| seen(particle, bounds, params).in_pixels_of(downsample));
                self.cells
                    .describe(&self.gradients, areas, params, out, centering);
            }
        }
    }

    /// Width and height of a cell of `particle`, in working pixels.
    pub fn cell(particle: &Particle, bounds: &StateBounds, params: &Params) -> (f64, f64) {
        let area = seen(particle, bounds, params);
        (
            area.width / f64::from(params.patch_width),
            area.height / f64::from(params.patch_height),
        )
    }

    /// Makes `grid` the cells of `center` and as many more as `more` says to the left and to the right, above and below:
    /// with room for `most` of these.
    pub fn grid(
        &mut self,
        center: &Particle,
        more: (usize, usize),
        most: usize,
        bounds: &StateBounds,
        params: &Params,
        grid: &mut Grid,
    ) {
        let sides = |more: (usize, usize)| {
            let width = params.patch_width + 2 * more.0 as u32;
            (width, params.patch_height + 2 * more.1 as u32)
        };
        let (columns, rows) = sides(more);
        let (most_columns, most_rows) = sides((most, most));
        let (x, y) = bounds.area(center).center();
        let (width, height) = Self::cell(center, bounds, params);
        let area = Rect::centered(x, y, width * f64::from(columns), height * f64::from(rows));
        let most = (most_columns * most_rows) as usize;
        clear_and_reserve(&mut grid.values, most * CHANNELS);
        clear_and_reserve(&mut grid.grays, most);
        grid.columns = columns as usize;
        grid.values
            .resize((columns * rows) as usize * CHANNELS, 0.0);
        let params = Params {
            patch_width: columns,
            patch_height: rows,
            ..params.clone()
        };
        let cells = &mut self.grid_cells;
        cells.reserve(most_columns as usize, most_rows as usize);
        let areas = std::iter::once(area.in_pixels_of(self.downsample));
        cells.describe(&self.gradients, areas, &params, &mut grid.values, None);
        grid.grays.extend(cells.grays());
        for cell in grid.values.as_chunks_mut::<CHANNELS>().0 {
            cell[DIRECTIONS] = 0.0;
        }
    }

    /// Writes gray features to `out`.
    pub fn cut(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        bounds: &StateBounds,
        params: &Params,
        out: &mut [f32],
    ) {
        let areas = particles
            .iter()
            .map(|particle| seen(particle, bounds, params));
        self.cutter.cut(frame, areas, params, out);
    }
}

/// The area that is looked at for a particle: its box and the context around it.
fn seen(particle: &Particle, bounds: &StateBounds, params: &Params) -> Rect {
    let area = bounds.area(particle);
    let (x, y) = area.center();
    Rect::centered(
        x,
        y,
        area.width * params.context,
        area.height * params.context,
    )
}
