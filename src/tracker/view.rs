//! From particles to the feature vectors of what is seen there, whichever features the parameters ask for.
//!
//! A view is open on one frame, around one place: what lies further off is not there.

use super::cells::Cells;
use super::gradients::GradientSums;
use super::motion::{Particle, Reach};
use super::patch::PatchCutter;
use super::{Features, GrayFrame, Params, Rect, pyramid};

/// How much larger than the last answer the areas of a frame may be: scales change by a few hundredths a frame.
const LARGER: f64 = 1.15;

/// Cuts feature vectors out of one frame.
#[derive(Debug, Default)]
pub(super) struct View {
    cutter: PatchCutter,
    gradients: GradientSums,
    cells: Cells,
}

impl View {
    /// Gets ready for areas around `center`, up to `furthest` working pixels from its centre and [`LARGER`] than it.
    pub fn open(
        &mut self,
        frame: &GrayFrame,
        center: &Particle,
        furthest: f64,
        reach: &Reach,
        params: &Params,
    ) {
        if params.features == Features::Gradients {
            let area = seen(center, reach, params);
            let (x, y) = area.center();
            // A pyramid is of the box alone, without its context.
            let larger = LARGER.max(pyramid::largest() / params.context);
            let width = larger * area.width + 2.0 * furthest;
            let height = larger * area.height + 2.0 * furthest;
            let cell = (
                area.width / f64::from(params.patch_width),
                area.height / f64::from(params.patch_height),
            );
            let window = Rect::centered(x, y, width, height);
            self.gradients.compute(frame, &window, cell);
        }
    }

    /// Appends the feature vectors, of length D, of `particles` to `out`.
    pub fn features(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        reach: &Reach,
        params: &Params,
        out: &mut Vec<f32>,
    ) {
        let len = params.feature_len();
        let before = out.len();
        out.resize(before + particles.len() * len, 0.0);
        match params.features {
            Features::Gray => {
                self.cut(frame, particles, reach, params, &mut out[before..]);
            }
            Features::Gradients => {
                let areas = particles
                    .iter()
                    .map(|particle| seen(particle, reach, params));
                self.cells
                    .describe(&self.gradients, areas, params, &mut out[before..]);
            }
        }
    }

    /// Writes gray features to `out`.
    pub fn cut(
        &mut self,
        frame: &GrayFrame,
        particles: &[Particle],
        reach: &Reach,
        params: &Params,
        out: &mut [f32],
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
