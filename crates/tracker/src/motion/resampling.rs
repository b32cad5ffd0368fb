//! The paper's particle filter (section III-A): each frame draws N of the last particles, each with the probability of
//! its weight, and moves each draw by a Gaussian step.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::motion::particles::{Particle, StateBounds};
use crate::motion::random::normal;
use crate::params::table::{Params, Search};

/// The particles of a frame, with their weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cloud {
    /// N particles.
    pub particles: Vec<Particle>,
    /// The weights, one for each particle; each at least 0, their sum 1.
    pub weights: Vec<f64>,
}

impl Cloud {
    /// N particles at `place`, with equal weights; none where the search does not resample the last particles.
    pub fn at(place: Particle, params: &Params) -> Option<Self> {
        let count = params.particles as usize;
        (params.search == Search::Resampled).then(|| Self {
            particles: vec![place; count],
            weights: vec![1.0 / count as f64; count],
        })
    }

    /// Draws N particles into `out`: multinomial resampling by weight, then Brownian motion. `sums` is a buffer.
    pub fn resample(
        &self,
        params: &Params,
        bounds: &StateBounds,
        generator: &mut ChaCha8Rng,
        sums: &mut Vec<f64>,
        out: &mut Vec<Particle>,
    ) {
        let mut total = 0.0;
        sums.clear();
        sums.extend(self.weights.iter().map(|weight| {
            total += weight;
            total
        }));
        out.clear();
        for _ in 0..params.particles {
            let draw = generator.random::<f64>() * total;
            // Rounding can put the draw at the sum of all weights, beyond the last particle.
            let chosen = sums.partition_point(|&sum| sum <= draw);
            let origin = self.particles[chosen.min(self.particles.len() - 1)];
            let mut step = |std: f64| std * normal(generator);
            let moved = Particle {
                x: origin.x + step(params.motion_std_x),
                y: origin.y + step(params.motion_std_y),
                scale: origin.scale + step(params.motion_std_scale),
            };
            out.push(bounds.clamp(moved));
        }
    }

    /// Whether the sizes and weights are those of N particles.
    pub fn is_valid_for(&self, params: &Params) -> bool {
        let count = params.particles as usize;
        let total: f64 = self.weights.iter().sum();
        (self.particles.len(), self.weights.len()) == (count, count)
            && self.weights.iter().all(|it| (0.0..=1.0).contains(it))
            && (total - 1.0).abs() < 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::random::{self, Draws};
    use crate::params::presets::Preset;

    const BOUNDS: StateBounds = StateBounds {
        frame_width: 320.0,
        frame_height: 240.0,
        box_width: 40.0,
        box_height: 30.0,
    };

    fn particle(x: f64) -> Particle {
        Particle {
            x,
            y: 100.0,
            scale: 1.0,
        }
    }

    fn proposals(frame: u64, params: &Params) -> Vec<Particle> {
        let mut out = Vec::new();
        let cloud = Cloud {
            particles: [60.0, 160.0, 260.0].map(particle).to_vec(),
            weights: vec![0.7, 0.0, 0.3],
        };
        let mut draws = random::generator(params.seed, frame, Draws::Particles);
        cloud.resample(params, &BOUNDS, &mut draws, &mut Vec::new(), &mut out);
        out
    }

    #[test]
    fn particles_are_drawn_by_weight_and_moved_by_the_standard_deviations() {
        let params = Params {
            particles: 1000,
            ..Preset::Paper.params()
        };
        let mut all = Vec::new();
        for frame in 0..20 {
            all.extend(proposals(frame, &params));
        }
        let count = all.len() as f64;
        let first: Vec<&Particle> = all.iter().filter(|particle| particle.x < 110.0).collect();
        assert!((first.len() as f64 / count - 0.7).abs() < 0.02);
        assert!(
            all.iter().all(|particle| (particle.x - 160.0).abs() > 50.0),
            "weight 0"
        );
        let deviation = |of: &dyn Fn(&Particle) -> f64| {
            let squares: f64 = first.iter().map(|particle| of(particle).powi(2)).sum();
            (squares / first.len() as f64).sqrt()
        };
        assert!((deviation(&|p| p.x - 60.0) - 5.0).abs() < 0.2);
        assert!((deviation(&|p| p.y - 100.0) - 5.0).abs() < 0.2);
        assert!((deviation(&|p| p.scale - 1.0) - 0.01).abs() < 0.0005);
    }

    #[test]
    fn draws_depend_on_seed_and_frame_alone() {
        let params = Preset::Paper.params();
        let other = Params {
            seed: 1,
            ..params.clone()
        };
        assert_eq!(proposals(5, &params), proposals(5, &params));
        assert_ne!(proposals(5, &params), proposals(6, &params));
        assert_ne!(proposals(5, &params), proposals(5, &other));
    }

    #[test]
    fn the_stream_of_draws_is_the_one_snapshots_were_made_with() {
        // A library that changed its streams would make restored sessions go on differently.
        let first = proposals(1, &Preset::Paper.params())[0];
        assert_eq!(first.x.to_bits(), FIRST_X.to_bits(), "{first:?}");
    }

    const FIRST_X: f64 = 264.0888480052092;
}
