//! (A) Where the particles of a frame are looked for, and what the place itself says.
//!
//! With [`Search::Answer`] the particles start from the last answer: itself, and draws around it; where the whole
//! picture moved, half of the draws around where the answer moved to. With a refined share, the rest of the particles
//! is then drawn narrowly around the best of these. The prior of a particle falls with its distance from the last
//! answer (or from where that moved to) and with the change of its scale.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::tracker::features::extractor::Extractor;
use crate::tracker::motion::particles::{Particle, StateBounds};
use crate::tracker::params::table::Params;
use crate::tracker::params::table::Search;

/// A shift below this, in working pixels, is within what a search covers anyway.
const NOTABLE_SHIFT: f64 = 2.0;

/// A wider search has as many times the first particles, up to this: a target is seen from a third of its box away.
const DENSEST: f64 = 4.0;
/// Particles that are drawn around each peak: one of several is within a quarter of a cell.
const AROUND_MAXIMUM: usize = 6;
/// The greatest number of modes.
const MAX_MODES: usize = 50;

/// The search of one frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchContext<'a> {
    /// The last answer.
    pub last: Particle,
    /// How far the whole picture moved, in working pixels.
    pub shift: (f64, f64),
    /// How many times as wide as usual the search is: more than once where the target is out of sight.
    pub search_scale: f64,
    pub params: &'a Params,
    pub bounds: &'a StateBounds,
}

fn normal(generator: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(generator)
}

impl SearchContext<'_> {
    /// Where the last answer would be had it moved with the picture.
    #[inline(always)]
    pub fn displaced(&self) -> Particle {
        Particle {
            x: self.last.x + self.shift.0,
            y: self.last.y + self.shift.1,
            ..self.last
        }
    }

    fn has_shift(&self) -> bool {
        self.shift.0.abs().max(self.shift.1.abs()) > NOTABLE_SHIFT
    }

    /// How far from the last answer a particle may come to be, in working pixels, but for one draw in a thousand.
    pub fn radius(&self) -> f64 {
        let draws = self.search_scale * self.params.motion_std_x.max(self.params.motion_std_y);
        let shift = self.shift.0.abs().max(self.shift.1.abs());
        3.3 * (draws + self.params.refined_std) + shift
    }

    /// How many particles are drawn in all, and how many of these first. Where the target is out of sight there are more.
    pub fn counts(&self) -> (usize, usize) {
        let (all, first) = (
            self.params.particles as usize,
            self.params.first_particles(),
        );
        let more = (first as f64 * (self.search_scale.min(DENSEST) - 1.0)) as usize;
        let more = more.min(self.most() - all);
        (all + more, first + more)
    }

    /// How many are drawn around the best of the first.
    pub fn refined(&self) -> usize {
        let (all, first) = self.counts();
        all - first
    }

    /// How many particles are drawn in all where the search is widest.
    pub fn most(&self) -> usize {
        let all = self.params.particles as usize;
        // The printed evaluation has room for N candidates.
        if self.params.search == Search::Resampled || !self.params.single_vector_candidate {
            return all;
        }
        let first = self.params.first_particles() as f64;
        let wide = all + (first * (DENSEST - 1.0)) as usize;
        wide.min(self.params.most_particles())
    }

    /// How far from the last answer every place is looked at, in working pixels; 0 where that is not done.
    pub fn scanned(&self) -> f64 {
        if self.params.dense_maxima == 0 {
            return 0.0;
        }
        let longer = self.bounds.box_width.max(self.bounds.box_height) * self.last.scale;
        self.radius().max(self.params.dense_radius * longer)
    }

    /// Draws the first particles around the last answer, and around `maxima`, into `out`.
    pub fn propose(
        &self,
        maxima: &[Particle],
        generator: &mut ChaCha8Rng,
        out: &mut Vec<Particle>,
    ) {
        let displaced = self.displaced();
        out.clear();
        out.push(self.bounds.clamp(self.last));
        // A search of one particle has no room for another.
        if self.has_shift() && self.params.particles > 1 {
            out.push(self.bounds.clamp(displaced));
        }
        let count = self.counts().1.max(out.len());
        self.propose_around(maxima, count / 2, generator, out);
        while out.len() < count {
            let moved = self.has_shift() && out.len().is_multiple_of(2);
            let from = if moved { displaced } else { self.last };
            let params = self.params;
            let drawn = Particle {
                x: from.x + self.search_scale * params.motion_std_x * normal(generator),
                y: from.y + self.search_scale * params.motion_std_y * normal(generator),
                scale: from.scale
                    * (self.search_scale * params.motion_std_scale * normal(generator)).exp(),
            };
            out.push(self.bounds.clamp(drawn));
        }
    }

    /// Draws particles around `maxima`, which are a cell apart, until there are `most`.
    fn propose_around(
        &self,
        maxima: &[Particle],
        most: usize,
        generator: &mut ChaCha8Rng,
        out: &mut Vec<Particle>,
    ) {
        for maximum in maxima {
            let (width, height) = Extractor::cell_size(maximum, self.bounds, self.params);
            for _ in 0..AROUND_MAXIMUM.min(most.saturating_sub(out.len())) {
                let scale_std = self.params.motion_std_scale;
                out.push(self.bounds.clamp(Particle {
                    x: maximum.x + 0.5 * width * normal(generator),
                    y: maximum.y + 0.5 * height * normal(generator),
                    scale: maximum.scale * (scale_std * normal(generator)).exp(),
                }));
            }
        }
    }

    /// Draws the rest of the particles around the best, by `weights`, of those in `particles`.
    pub fn refine(
        &self,
        weights: &[f64],
        generator: &mut ChaCha8Rng,
        particles: &mut Vec<Particle>,
    ) {
        let mut modes = [0; MAX_MODES];
        let count = (self.params.refined_modes as usize).min(particles.len());
        let modes = &mut modes[..count];
        best(weights, modes);
        let all = self.counts().0.min(particles.len() + self.refined());
        let params = self.params;
        for &mode in modes.iter().cycle() {
            if particles.len() >= all {
                break;
            }
            let from = particles[mode];
            let drawn = Particle {
                x: from.x + params.refined_std * normal(generator),
                y: from.y + params.refined_std * normal(generator),
                scale: from.scale * (params.refined_std_scale * normal(generator)).exp(),
            };
            particles.push(self.bounds.clamp(drawn));
        }
    }

    /// The logarithm of the prior of how far a particle is from the last answer, or from where it was carried to.
    #[inline(always)]
    pub fn log_displacement(&self, particle: &Particle) -> f64 {
        if self.params.displacement_std <= 0.0 {
            return 0.0;
        }
        let squared =
            |from: &Particle| (particle.x - from.x).powi(2) + (particle.y - from.y).powi(2);
        let nearest = squared(&self.last).min(squared(&self.displaced()));
        // The square of a tiny deviation is 0, and 0 / 0 would be no prior.
        let variance = (self.search_scale * self.params.displacement_std).powi(2);
        -0.5 * nearest / variance.max(f64::MIN_POSITIVE)
    }

    /// The logarithms of the priors of `particles`: 0 at the last answer and where it was carried to.
    pub fn priors(&self, particles: &[Particle]) -> impl Iterator<Item = f64> {
        let last_scale = self.last.scale.ln();
        particles
            .iter()
            .map(move |particle| self.prior(particle, last_scale))
    }

    fn prior(&self, particle: &Particle, last_scale: f64) -> f64 {
        if self.params.search == Search::Resampled {
            return 0.0;
        }
        let mut exponent = -2.0 * self.log_displacement(particle);
        let scale = particle.scale.ln();
        if self.params.scale_change_std > 0.0 {
            let change = scale - last_scale;
            exponent += (change / self.search_scale / self.params.scale_change_std).powi(2);
        }
        if self.params.scale_std > 0.0 {
            exponent += scale.powi(2) / self.params.scale_std.powi(2).max(f64::MIN_POSITIVE);
        }
        -0.5 * exponent
    }
}

/// The indices of the greatest weights, greatest first, of equals the first first.
fn best(weights: &[f64], out: &mut [usize]) {
    let precedes = |a: usize, b: usize| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)).is_lt();
    for place in 0..out.len() {
        let left = (0..weights.len()).filter(|&i| place == 0 || precedes(out[place - 1], i));
        let next = left.reduce(|best, i| if precedes(i, best) { i } else { best });
        out[place] = next.expect("no more places than weights");
    }
}

/// The weighted mean, of scales the geometric one, of the particles within `radius` (working pixels) of the one at `best`.
pub(crate) fn average(
    particles: &[Particle],
    weights: &[f64],
    best: usize,
    radius: f64,
) -> Particle {
    let center = particles[best];
    let mut mean = Particle {
        x: 0.0,
        y: 0.0,
        scale: 0.0,
    };
    let mut total = 0.0;
    for (particle, &weight) in particles.iter().zip(weights) {
        let squared = (particle.x - center.x).powi(2) + (particle.y - center.y).powi(2);
        if squared < radius * radius {
            mean.x += weight * particle.x;
            mean.y += weight * particle.y;
            mean.scale += weight * particle.scale.ln();
            total += weight;
        }
    }
    if total > 0.0 {
        Particle {
            x: mean.x / total,
            y: mean.y / total,
            scale: (mean.scale / total).exp(),
        }
    } else {
        center
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::params::presets::Preset;

    #[test]
    fn the_best_are_those_of_a_sort() {
        let weights: Vec<f64> = (0..60).map(|i| f64::from(i * 37 % 11)).collect();
        let mut sorted: Vec<usize> = (0..60).collect();
        sorted.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
        for count in [0, 1, 5, 50, 60] {
            let mut found = vec![0; count];
            best(&weights, &mut found);
            assert_eq!(found, sorted[..count]);
        }
    }

    #[test]
    fn the_widest_search_costs_no_more_than_parameters_may() {
        let bounds = StateBounds {
            frame_width: 100.0,
            frame_height: 80.0,
            box_width: 20.0,
            box_height: 10.0,
        };
        let most = |params: &Params| {
            assert_eq!(params.validate(), Ok(()));
            let search = SearchContext {
                last: Particle {
                    x: 50.0,
                    y: 40.0,
                    scale: 1.0,
                },
                shift: (0.0, 0.0),
                search_scale: DENSEST,
                params,
                bounds: &bounds,
            };
            assert_eq!(search.counts().0, search.most());
            search.most()
        };
        let robust = Preset::Robust.params();
        assert_eq!(most(&robust), 500);
        let large = |particles, side, background_samples| Params {
            particles,
            patch_width: side,
            patch_height: side,
            background_samples,
            ..robust.clone()
        };
        // Limited by their number, by their values, and by their products with the background; at the limit already.
        for (params, expected) in [
            (large(600, 8, 64), 1000),
            (large(200, 20, 32), 275),
            (large(600, 8, 200), 809),
            (large(47, 48, 0), 47),
        ] {
            let most = most(&params);
            assert_eq!(most, expected);
            let widest = Params {
                particles: most as u32,
                ..params.clone()
            };
            assert_eq!(widest.validate(), Ok(()));
        }
    }

    #[test]
    fn a_prior_of_any_width_is_greatest_at_the_last_answer_and_falls() {
        let bounds = StateBounds {
            frame_width: 100.0,
            frame_height: 80.0,
            box_width: 20.0,
            box_height: 10.0,
        };
        let last = Particle {
            x: 50.0,
            y: 40.0,
            scale: 1.0,
        };
        for std in [0.0, 5e-324, 1e-200, 1e-3, 12.0] {
            let params = Params {
                displacement_std: std,
                scale_change_std: std.min(10.0),
                scale_std: 0.0,
                ..Preset::Robust.params()
            };
            let search = SearchContext {
                last,
                shift: (0.0, 0.0),
                search_scale: 1.0,
                params: &params,
                bounds: &bounds,
            };
            let prior = |particle| search.priors(&[particle]).next().expect("one of one");
            assert_eq!(prior(last), 0.0, "{std}");
            let beside = Particle {
                x: 53.0,
                scale: 1.01,
                ..last
            };
            let prior = prior(beside);
            let falls = if std > 0.0 { prior < 0.0 } else { prior == 0.0 };
            assert!(falls, "{std}: {prior}");
        }
    }
}
