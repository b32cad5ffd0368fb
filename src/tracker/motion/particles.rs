//! (A) Particles: where the target may be in the next frame.
//!
//! Each frame draws N particles from the last ones with the probability of their weights, and moves each by a
//! Gaussian step (section III-A). The draws of frame t come from a generator seeded with (seed, t): no generator is
//! part of the state, and one frame given twice to the same state gives the same particles.
//!
//! A random walk knows no limits, so it is held: the box touches the frame by a pixel, its scale stays within
//! [`StateBounds::scales`].

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::tracker::image::rect::Rect;
use crate::tracker::image::warp::Rotation;
use crate::tracker::params::table::Params;
use crate::tracker::state::State;

/// One hypothesis z = (x, y, s): the centre in working pixels, and the scale against the reference box.
///
/// The paper's state is the top-left corner; the centre keeps the place of a target that changes its size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Particle {
    /// Centre along x, in working pixels.
    pub x: f64,
    /// Centre along y, in working pixels.
    pub y: f64,
    /// Scale; the reference box has 1.
    pub scale: f64,
}

impl Particle {
    /// This particle of a rotated image, where it is in the original image.
    pub fn to_original(self, rotation: &Rotation) -> Self {
        let (x, y) = rotation.to_original((self.x, self.y));
        Self { x, y, ..self }
    }
}

/// How far particles may go: the working image, and the reference box whose aspect every particle keeps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct StateBounds {
    /// Width of the working image.
    pub frame_width: f64,
    /// Height of the working image.
    pub frame_height: f64,
    /// Width of the box at scale 1, in working pixels.
    pub box_width: f64,
    /// Height of the box at scale 1, in working pixels.
    pub box_height: f64,
}

impl StateBounds {
    /// The least and the greatest scale: within 1/10 and 10, the shorter side of the box not below one working
    /// pixel, the longer not above four times that of the frame. Always contains 1.
    pub fn scales(&self) -> (f64, f64) {
        let shorter = self.box_width.min(self.box_height);
        let longer = self.box_width.max(self.box_height);
        let frame = self.frame_width.max(self.frame_height);
        let least = (1.0 / shorter).clamp(0.1, 1.0);
        let greatest = (4.0 * frame / longer).clamp(1.0, 10.0);
        (least, greatest)
    }

    /// The nearest particle that is allowed.
    pub fn clamp(&self, particle: Particle) -> Particle {
        let (least, greatest) = self.scales();
        let scale = particle.scale.clamp(least, greatest);
        let overhang = |side: f64| (side * scale / 2.0 - 1.0).max(0.0);
        let (left, up) = (overhang(self.box_width), overhang(self.box_height));
        Particle {
            x: particle.x.clamp(-left, self.frame_width + left),
            y: particle.y.clamp(-up, self.frame_height + up),
            scale,
        }
    }

    /// The candidate area of `particle`, in working pixels.
    pub fn area(&self, particle: &Particle) -> Rect {
        Rect::centered(
            particle.x,
            particle.y,
            self.box_width * particle.scale,
            self.box_height * particle.scale,
        )
    }
}

/// What draws are for: each has draws of its own.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Draws {
    /// The particles of a frame.
    Particles,
    /// Areas that the background and the discriminant learn from.
    TrainingSamples,
}

/// The generator of the draws of frame `frame`.
pub(crate) fn generator(seed: u64, frame: u64, draws: Draws) -> ChaCha8Rng {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    // Frame numbers stay far below the bit that tells the two apart.
    generator.set_stream(match draws {
        Draws::Particles => frame,
        Draws::TrainingSamples => frame | 1 << 63,
    });
    generator
}

/// Draws the next particles of `state` into `out`: multinomial resampling by weight, then Brownian motion. `sums` is room.
pub(crate) fn propose(
    state: &State,
    generator: &mut ChaCha8Rng,
    sums: &mut Vec<f64>,
    out: &mut Vec<Particle>,
) {
    let cloud = (&state.particles[..], &state.weights[..]);
    resample(cloud, &state.params, &state.bounds, generator, sums, out);
}

/// As [`propose`], of particles and their weights (which are at least 0 and sum to 1).
fn resample(
    (previous, weights): (&[Particle], &[f64]),
    params: &Params,
    bounds: &StateBounds,
    generator: &mut ChaCha8Rng,
    sums: &mut Vec<f64>,
    out: &mut Vec<Particle>,
) {
    let mut total = 0.0;
    sums.clear();
    sums.extend(weights.iter().map(|weight| {
        total += weight;
        total
    }));
    out.clear();
    for _ in 0..params.first_particles() {
        let draw = generator.random::<f64>() * total;
        // Rounding can put the draw at the very end.
        let chosen = sums
            .partition_point(|&sum| sum <= draw)
            .min(previous.len() - 1);
        let mut step = |std: f64| -> f64 {
            let normal: f64 = StandardNormal.sample(generator);
            normal * std
        };
        let origin = previous[chosen];
        let moved = Particle {
            x: origin.x + step(params.motion_std_x),
            y: origin.y + step(params.motion_std_y),
            scale: origin.scale + step(params.motion_std_scale),
        };
        out.push(bounds.clamp(moved));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::params::presets::Preset;

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
        let previous = [particle(60.0), particle(160.0), particle(260.0)];
        let cloud = (&previous[..], &[0.7, 0.0, 0.3][..]);
        let mut draws = generator(params.seed, frame, Draws::Particles);
        resample(
            cloud,
            params,
            &BOUNDS,
            &mut draws,
            &mut Vec::new(),
            &mut out,
        );
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
