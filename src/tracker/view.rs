//! From particles to the feature vectors of what is seen there, whichever features the parameters ask for.
//!
//! A view is open on one frame, around one place: what lies further off is not there.

use super::cells::Cells;
use super::gradients::GradientSums;
use super::motion::{Particle, Reach};
use super::patch::PatchCutter;
use super::{Features, GrayFrame, Params, Rect, pyramid};

/// How much larger than the largest particle the areas of a frame may be: scales change by a few hundredths a frame.
const LARGER: f64 = 1.08;

/// Cuts feature vectors out of one frame.
#[derive(Debug, Default)]
pub(super) struct View {
    cutter: PatchCutter,
    gradients: GradientSums,
    cells: Cells,
    exact: Vec<f64>,
}

impl View {
    /// Gets ready for the areas of `particles`, of which there is one, and for others up to `furthest` working pixels from
    /// one of these and [`LARGER`] than the largest.
    pub fn open(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        furthest: f64,
        reach: &Reach,
        params: &Params,
    ) {
        if params.features == Features::Gradients {
            let mut largest = particles[0];
            let (mut left, mut right) = (largest.x, largest.x);
            let (mut top, mut bottom) = (largest.y, largest.y);
            for particle in particles {
                (left, right) = (left.min(particle.x), right.max(particle.x));
                (top, bottom) = (top.min(particle.y), bottom.max(particle.y));
                largest.scale = largest.scale.max(particle.scale);
            }
            let area = seen(&largest, reach, params);
            // A pyramid is of the box alone, without its context.
            let larger = LARGER.max(pyramid::largest() / params.context);
            let (width, height) = (larger * area.width, larger * area.height);
            let window = Rect::new(
                left - furthest - width / 2.0,
                top - furthest - height / 2.0,
                right - left + 2.0 * furthest + width,
                bottom - top + 2.0 * furthest + height,
            );
            // One size of cells for all: the first particle is the last answer.
            let area = seen(&particles[0], reach, params);
            let cell = (
                area.width / f64::from(params.patch_width),
                area.height / f64::from(params.patch_height),
            );
            self.gradients.compute(frame, &window, cell);
        }
    }

    /// Makes `out` the feature vectors, of length D, of `particles`.
    pub fn features(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        reach: &Reach,
        params: &Params,
        out: &mut Vec<f32>,
    ) {
        out.resize(particles.len() * params.feature_len(), 0.0);
        self.describe(frame, particles, reach, params, out);
    }

    /// Writes the feature vectors, of length D, of `particles` to `out`, which is as long as they are.
    pub fn describe(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        reach: &Reach,
        params: &Params,
        out: &mut [f32],
    ) {
        match params.features {
            Features::Gray => {
                let mut exact = std::mem::take(&mut self.exact);
                exact.resize(particles.len() * params.feature_len(), 0.0);
                self.cut(frame, particles, reach, params, &mut exact);
                for (value, exact) in out.iter_mut().zip(&exact) {
                    *value = *exact as f32;
                }
                self.exact = exact;
            }
            Features::Gradients => {
                let areas = particles
                    .iter()
                    .map(|particle| seen(particle, reach, params));
                self.cells.describe(&self.gradients, areas, params, out);
            }
        }
    }

    /// Writes gray features, exact in single precision, to `out`.
    pub fn cut(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        reach: &Reach,
        params: &Params,
        out: &mut [f64],
    ) {
        let areas = particles
            .iter()
            .map(|particle| seen(particle, reach, params));
        self.cutter.cut(frame, areas, params, out);
    }
}

/// The area that is looked at for a particle: its box and the context around it.
fn seen(particle: &Particle, reach: &Reach, params: &Params) -> Rect {
    let area = reach.area(particle);
    let (x, y) = area.center();
    Rect::centered(
        x,
        y,
        area.width * params.context,
        area.height * params.context,
    )
}
