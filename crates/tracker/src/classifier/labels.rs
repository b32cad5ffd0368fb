//! The labels that the discriminant is fitted to, and the areas of the first fit.

use rand_chacha::ChaCha8Rng;

use crate::motion::particles::{Particle, StateBounds};
use crate::motion::random::normal;

/// Standard deviation of the labels' bell, as a share of the box along x and y, and of the logarithm of the scale.
const LABEL_WIDTH: f64 = 0.15;
/// The number of areas around the first box in the first fit, and the standard deviations of their offsets, as shares
/// of the box; each holds for a third of the areas. So near misses, misses and the surroundings are all learned.
const FIRST_AREAS: usize = 300;
const FIRST_STDS: [f64; 3] = [0.1, 0.3, 0.8];
/// The standard deviation of the logarithm of an area's scale, as a share of that of its offset.
const FIRST_SCALE_STD: f64 = 0.3;

/// Makes `out` the labels of `areas`.
pub(crate) fn label_all(
    areas: &[Particle],
    target: &Particle,
    bounds: &StateBounds,
    out: &mut Vec<f32>,
) {
    out.clear();
    out.extend(areas.iter().map(|area| label(area, target, bounds)));
}

/// Makes `areas` the target itself and draws around it, for the first fit.
pub(crate) fn first_areas(
    target: &Particle,
    bounds: &StateBounds,
    draws: &mut ChaCha8Rng,
    areas: &mut Vec<Particle>,
) {
    areas.clear();
    areas.push(*target);
    for std in FIRST_STDS.iter().cycle().take(FIRST_AREAS) {
        areas.push(bounds.clamp(Particle {
            x: target.x + std * bounds.box_width * target.scale * normal(draws),
            y: target.y + std * bounds.box_height * target.scale * normal(draws),
            scale: target.scale * (FIRST_SCALE_STD * std * normal(draws)).exp(),
        }));
    }
}

/// How much of the target an area shows, as the discriminant is taught: 1 at `target`, falling as a bell with the
/// distance and the ratio of scales.
fn label(area: &Particle, target: &Particle, bounds: &StateBounds) -> f32 {
    let across = (area.x - target.x) / (bounds.box_width * target.scale);
    let down = (area.y - target.y) / (bounds.box_height * target.scale);
    let larger = (area.scale / target.scale).ln();
    let squared = across * across + down * down + larger * larger;
    (-0.5 * squared / (LABEL_WIDTH * LABEL_WIDTH)).exp() as f32
}
