//! Draws of the search around the last answer, in two rounds.
//!
//! The first round draws around the last answer and, where the image moved, around the last answer moved with it; up to
//! half of the round is drawn around the maxima of the dense search. The second round is drawn narrowly around the best
//! of the first.

use rand_chacha::ChaCha8Rng;

use crate::motion::particles::Particle;
use crate::motion::random::normal;
use crate::motion::search::{REFINED_STD, SearchContext};
use crate::params::table::Search;

/// Particles drawn around each maximum: of so many, about one is within a quarter of a cell of it.
const AROUND_MAXIMUM: usize = 6;
/// Around how many of the best particles the second round is drawn.
const MODES: usize = 5;
/// Standard deviation, in the second round, of the logarithm of the scale.
const REFINED_STD_SCALE: f64 = 0.01;
/// The uncertainty of a box's side, in working pixels, before and after the first round. For a box of ten pixels it
/// exceeds the usual change of scale.
const BLUR: f64 = 0.4;
const REFINED_BLUR: f64 = 0.3;
/// An answer is the mean of the particles this near to the most likely one, in working pixels: a mean is steadier than
/// one particle.
const AVERAGING_RADIUS: f64 = 3.0;

impl SearchContext<'_> {
    /// Makes `out` the particles of the first round. `maxima` are those of the dense search, whose cells have the size
    /// `cell` = (width, height) in working pixels.
    pub fn propose(
        &self,
        maxima: &[Particle],
        cell: (f64, f64),
        generator: &mut ChaCha8Rng,
        out: &mut Vec<Particle>,
    ) {
        out.clear();
        out.push(self.bounds.clamp(self.last));
        // A search of one particle has no room for a second.
        if self.is_displaced() && self.params.particles > 1 {
            out.push(self.bounds.clamp(self.displaced()));
        }
        let count = self.counts().1.max(out.len());
        let scale_std = self.scale_std(self.params.motion_std_scale, BLUR);
        for maximum in maxima {
            let std = (0.5 * cell.0, 0.5 * cell.1, scale_std);
            for _ in 0..AROUND_MAXIMUM.min((count / 2).saturating_sub(out.len())) {
                out.push(self.draw(maximum, std, generator));
            }
        }
        let std = (
            self.spread * self.params.motion_std_x,
            self.spread * self.params.motion_std_y,
            self.spread * scale_std,
        );
        while out.len() < count {
            let is_displaced = self.is_displaced() && out.len().is_multiple_of(2);
            let center = if is_displaced {
                self.displaced()
            } else {
                self.last
            };
            out.push(self.draw(&center, std, generator));
        }
    }

    /// Appends the particles of the second round, around those of `particles` with the greatest `weights`. Tells
    /// whether there is a second round.
    pub fn refine(
        &self,
        weights: &[f64],
        generator: &mut ChaCha8Rng,
        particles: &mut Vec<Particle>,
    ) -> bool {
        let (all, first) = self.counts();
        if all == first {
            return false;
        }
        let mut modes = [0; MODES];
        let modes = &mut modes[..MODES.min(particles.len())];
        greatest(weights, modes);
        for &mode in modes.iter().cycle() {
            if particles.len() >= all {
                break;
            }
            let std = (
                REFINED_STD,
                REFINED_STD,
                self.scale_std(REFINED_STD_SCALE, REFINED_BLUR),
            );
            let drawn = self.draw(&particles[mode], std, generator);
            particles.push(drawn);
        }
        true
    }

    /// The answer: the particle at `best` (equation 12) or, searching from the last answer, the weighted mean of the
    /// particles around it (of their scales the geometric mean).
    pub fn answer(&self, particles: &[Particle], weights: &[f64], best: usize) -> Particle {
        let center = particles[best];
        if self.params.search == Search::Resampled {
            return center;
        }
        let (mut x, mut y, mut log_scale, mut total) = (0.0, 0.0, 0.0, 0.0);
        for (particle, &weight) in particles.iter().zip(weights) {
            let squared = (particle.x - center.x).powi(2) + (particle.y - center.y).powi(2);
            if squared < AVERAGING_RADIUS * AVERAGING_RADIUS {
                x += weight * particle.x;
                y += weight * particle.y;
                log_scale += weight * particle.scale.ln();
                total += weight;
            }
        }
        if total <= 0.0 {
            return center;
        }
        let scale = (log_scale / total).exp();
        let (x, y) = (x / total, y / total);
        Particle { x, y, scale }
    }

    /// The standard deviation of the logarithm of the scale: `std`, and more for a box so small that `blur` working
    /// pixels are a notable share of its sides.
    fn scale_std(&self, std: f64, blur: f64) -> f64 {
        std.hypot(blur / self.bounds.side(&self.last))
    }

    /// A draw around `center`; the standard deviations are of x, of y and of the logarithm of the scale.
    fn draw(
        &self,
        center: &Particle,
        std: (f64, f64, f64),
        generator: &mut ChaCha8Rng,
    ) -> Particle {
        self.bounds.clamp(Particle {
            x: center.x + std.0 * normal(generator),
            y: center.y + std.1 * normal(generator),
            scale: center.scale * (std.2 * normal(generator)).exp(),
        })
    }
}

/// Fills `out` with the indices of the greatest weights, greatest first; of equal weights the lower index first.
fn greatest(weights: &[f64], out: &mut [usize]) {
    let precedes = |a: usize, b: usize| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)).is_lt();
    for place in 0..out.len() {
        let left = (0..weights.len()).filter(|&i| place == 0 || precedes(out[place - 1], i));
        let next = left.reduce(|best, i| if precedes(i, best) { i } else { best });
        out[place] = next.expect("no more indices than weights");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_weights_are_those_of_a_sort() {
        let weights: Vec<f64> = (0..60).map(|i| f64::from(i * 37 % 11)).collect();
        let mut sorted: Vec<usize> = (0..60).collect();
        sorted.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
        for count in [0, 1, 5, 50, 60] {
            let mut found = vec![0; count];
            greatest(&weights, &mut found);
            assert_eq!(found, sorted[..count]);
        }
    }
}
