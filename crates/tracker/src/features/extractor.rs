//! From particles to their feature vectors: gray patches or gradient histograms, as the parameters say.
//!
//! [`compute_channels`](Extractor::compute_channels) comes first in each frame. It covers a window of the frame;
//! feature vectors are for areas in that window.

use crate::features::gray::GrayPatches;
use crate::features::hog::cells::HogCells;
use crate::features::hog::channels::{CHANNELS, GRAY};
use crate::features::hog::descriptor::{self, Layout};
use crate::features::hog::integral::IntegralChannels;
use crate::image::downsample;
use crate::image::frame::Frame;
use crate::image::rect::Rect;
use crate::linalg::scratch::clear_and_reserve;
use crate::motion::particles::{Particle, StateBounds};
use crate::params::table::{Features, Params};

/// How much larger than the largest particle the areas of a frame may be. Scales change by a few percent a frame.
const SCALE_MARGIN: f64 = 1.08;
/// How much larger than its particle the largest level of a scale pyramid is; a test of `scale/pyramid.rs` checks this.
pub(crate) const PYRAMID_MARGIN: f64 = 1.271_249_150_321_404_7;

/// Computes the feature vectors of one frame's particles; its memory is kept from one frame to the next.
#[derive(Debug, Default)]
pub(crate) struct Extractor {
    gray: GrayPatches,
    /// The side of one of the frame's pixels, in working pixels.
    downsample: f64,
    integral: IntegralChannels,
    hog: HogCells,
    /// The cells of grids, which have other numbers of cells than particles.
    grid_hog: HogCells,
}

/// The cells of a particle and its surroundings, row by row.
#[derive(Debug, Default)]
pub(crate) struct Grid {
    pub columns: usize,
    /// The channels of each cell, normalised, with a gray value of 0.
    pub values: Vec<f32>,
    /// The gray sum of each cell, up to a constant, not normalised.
    pub grays: Vec<f32>,
}

impl Extractor {
    /// The window, in working pixels, that holds the areas of `particles` (at least one), and those of all particles
    /// within `radius` working pixels of them whose scale is at most [`SCALE_MARGIN`] times the largest.
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
        let area = context_area(&largest, bounds, params);
        // A scale pyramid shows the box alone, without its context.
        let margin = SCALE_MARGIN.max(PYRAMID_MARGIN / params.context);
        let (width, height) = (margin * area.width, margin * area.height);
        Rect::new(
            left - radius - width / 2.0,
            top - radius - height / 2.0,
            right - left + 2.0 * radius + width,
            bottom - top + 2.0 * radius + height,
        )
    }

    /// Computes what the areas in the [`window`](Self::window) of these particles share. The first particle is the last
    /// answer: its cells decide the resolution.
    pub fn compute_channels(
        &mut self,
        frame: &Frame,
        particles: &[Particle],
        radius: f64,
        bounds: &StateBounds,
        params: &Params,
    ) {
        self.downsample = f64::from(frame.luma.pixel_side);
        if params.features == Features::Gradients {
            let window = Self::window(particles, radius, bounds, params);
            let (width, height) = Self::cell_size(&particles[0], bounds, params);
            let cell = (width / self.downsample, height / self.downsample);
            let window = window.in_pixels_of(self.downsample);
            self.integral.compute(frame, &window, cell);
        }
    }

    /// Replaces `out` by the feature vectors of `particles`, of length D each.
    pub fn features(
        &mut self,
        frame: &Frame,
        particles: &[Particle],
        bounds: &StateBounds,
        params: &Params,
        out: &mut Vec<f32>,
    ) {
        out.resize(particles.len() * params.feature_len(), 0.0);
        self.describe(frame, particles, bounds, params, out);
    }

    /// Writes the feature vectors of `particles`, of length D each, to `out`, which has room for just these.
    pub fn describe(
        &mut self,
        frame: &Frame,
        particles: &[Particle],
        bounds: &StateBounds,
        params: &Params,
        out: &mut [f32],
    ) {
        let areas = particles
            .iter()
            .map(|particle| context_area(particle, bounds, params));
        match params.features {
            Features::Gray => self.gray.cut(frame, areas, params, out),
            Features::Gradients => {
                let areas = areas.map(|area| area.in_pixels_of(self.downsample));
                let (hog, integral) = (&mut self.hog, &self.integral);
                descriptor::describe(hog, integral, areas, Layout::of(params), out);
            }
        }
    }

    /// Width and height of a cell of `particle`, in working pixels.
    pub fn cell_size(particle: &Particle, bounds: &StateBounds, params: &Params) -> (f64, f64) {
        let area = context_area(particle, bounds, params);
        (
            area.width / f64::from(params.patch_width),
            area.height / f64::from(params.patch_height),
        )
    }

    /// The downsample factor at which `target` is searched: 1, 2 or 4. Gray patches are cut from the frame itself.
    pub fn downsample_factor(target: &Particle, bounds: &StateBounds, params: &Params) -> usize {
        if params.features == Features::Gray {
            return 1;
        }
        let first = Particle {
            scale: 1.0,
            ..*target
        };
        let (width, height) = Self::cell_size(&first, bounds, params);
        let first_cell = width.min(height);
        let frame_side = bounds.frame_width.min(bounds.frame_height);
        downsample::factor(first_cell, first_cell * target.scale, frame_side)
    }

    /// Replaces `grid` by the cells of `center`, with `margin` more columns on either side and `margin` more rows above
    /// and below. Reserves memory for `max_margin` of both.
    pub fn grid(
        &mut self,
        center: &Particle,
        margin: (usize, usize),
        max_margin: usize,
        bounds: &StateBounds,
        params: &Params,
        grid: &mut Grid,
    ) {
        let own = Layout::of(params);
        let (columns, rows) = (own.columns + 2 * margin.0, own.rows + 2 * margin.1);
        let (max_columns, max_rows) = (own.columns + 2 * max_margin, own.rows + 2 * max_margin);
        let (x, y) = bounds.area(center).center();
        let (width, height) = Self::cell_size(center, bounds, params);
        let area = Rect::centered(x, y, width * columns as f64, height * rows as f64);
        clear_and_reserve(&mut grid.values, max_columns * max_rows * CHANNELS);
        clear_and_reserve(&mut grid.grays, max_columns * max_rows);
        grid.columns = columns;
        grid.values.resize(columns * rows * CHANNELS, 0.0);
        let areas = std::iter::once(area.in_pixels_of(self.downsample));
        let hog = &mut self.grid_hog;
        hog.reserve(max_columns, max_rows);
        let layout = Layout {
            columns,
            rows,
            ..own
        };
        descriptor::describe(hog, &self.integral, areas, layout, &mut grid.values);
        grid.grays.extend(hog.cells.iter().map(|cell| cell.0[GRAY]));
        for cell in grid.values.as_chunks_mut::<CHANNELS>().0 {
            cell[GRAY] = 0.0;
        }
    }
}

/// The area of a particle's features: its box and the context around it, in working pixels.
fn context_area(particle: &Particle, bounds: &StateBounds, params: &Params) -> Rect {
    let area = bounds.area(particle);
    let (x, y) = area.center();
    Rect::centered(
        x,
        y,
        area.width * params.context,
        area.height * params.context,
    )
}
