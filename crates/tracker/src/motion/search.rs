//! The search around the last answer: how wide it is, how many particles it draws, and the prior on the displacement.

use crate::image::warp::Rotation;
use crate::motion::particles::{Particle, StateBounds};
use crate::params::table::{Params, Search};

/// A displacement of the image below this, in working pixels, is within what a search covers anyway.
const NOTABLE_DISPLACEMENT: f64 = 2.0;
/// A search that is k times as wide draws k times as many particles in its first round, k at most this: a target is
/// recognised from a third of its box away.
const MAX_DENSITY: f64 = 4.0;
/// The share of the particles that are drawn in the second round, around the best of the first.
const REFINED_SHARE: f64 = 0.5;
/// Standard deviation of the draws of the second round along x and along y, in working pixels.
pub(crate) const REFINED_STD: f64 = 2.0;
/// How far the dense search looks, as a multiple of the box's longer side: a target that moves by its own length is
/// still seen.
const DENSE_RADIUS: f64 = 1.0;
/// How many times as wide as usual the prior on the displacement is at most.
pub(crate) const MAX_PRIOR_WIDTH: f64 = 2.0;

/// The search of one frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchContext<'a> {
    /// The last answer.
    pub last: Particle,
    /// The displacement of the whole image, in working pixels of the rectified view.
    pub displacement: (f64, f64),
    /// The rotation that makes a rotated target upright; particles are in the view rotated so. None where the target is
    /// upright.
    pub rotation: Option<Rotation>,
    /// How many times as wide as usual the search is: more than once while the target is lost.
    pub spread: f64,
    /// How far from the last answer background is sampled in this frame, in working pixels.
    pub samples_radius: f64,
    pub params: &'a Params,
    pub bounds: &'a StateBounds,
}

impl SearchContext<'_> {
    /// Where the last answer would be had it moved with the image.
    #[inline(always)]
    pub fn displaced(&self) -> Particle {
        Particle {
            x: self.last.x + self.displacement.0,
            y: self.last.y + self.displacement.1,
            ..self.last
        }
    }

    /// Whether the image moved further than a search covers anyway.
    pub fn is_displaced(&self) -> bool {
        self.displacement.0.abs().max(self.displacement.1.abs()) > NOTABLE_DISPLACEMENT
    }

    /// How far from the last answer a particle may be drawn, in working pixels, but for one draw in a thousand.
    pub fn radius(&self) -> f64 {
        let std = self.spread * self.params.motion_std_x.max(self.params.motion_std_y);
        let displacement = self.displacement.0.abs().max(self.displacement.1.abs());
        3.3 * (std + REFINED_STD) + displacement
    }

    /// How far from the last answer the dense search looks, in working pixels; 0 where it is off.
    pub fn dense_radius(&self) -> f64 {
        if self.params.dense_maxima == 0 {
            return 0.0;
        }
        let longer = self.bounds.box_width.max(self.bounds.box_height) * self.last.scale;
        self.radius().max(DENSE_RADIUS * longer)
    }

    /// How far around the last answer the frame is looked at, in working pixels.
    pub fn window_radius(&self) -> f64 {
        (self.radius() + self.samples_radius).max(self.dense_radius())
    }

    /// `particle`, given in the rectified view, at its place in the frame.
    pub fn in_frame(&self, particle: Particle) -> Particle {
        self.rotation.map_or(particle, |rotation| {
            let (x, y) = rotation.to_original((particle.x, particle.y));
            Particle { x, y, ..particle }
        })
    }

    /// How many particles are drawn in all, and how many of these in the first round. A wider search draws more.
    pub fn counts(&self) -> (usize, usize) {
        let (all, first) = usual_counts(self.params);
        let more = (first as f64 * (self.spread.min(MAX_DENSITY) - 1.0)) as usize;
        let more = more.min(max_count(self.params) - all);
        (all + more, first + more)
    }

    /// The logarithm of the prior on the displacement of a particle, from the last answer or from the last answer moved
    /// with the image, whichever is nearer. The prior is `prior_width` times as wide as usual.
    #[inline(always)]
    pub fn log_prior(&self, particle: &Particle, prior_width: f64) -> f64 {
        if self.params.displacement_std <= 0.0 || self.params.search == Search::Resampled {
            return 0.0;
        }
        let squared =
            |from: &Particle| (particle.x - from.x).powi(2) + (particle.y - from.y).powi(2);
        let nearest = squared(&self.last).min(squared(&self.displaced()));
        // The square of a tiny deviation is 0, and 0 / 0 would be no prior.
        let variance = (prior_width * self.spread * self.params.displacement_std).powi(2);
        -0.5 * nearest / variance.max(f64::MIN_POSITIVE)
    }
}

/// How many times as wide as usual the prior on the displacement is at a place whose distance to the first subspace is
/// `distance`; that of the last answer was `last`. An occluder resembles the first image less than the
/// target that reappears beside it.
pub(crate) fn prior_width(last: f64, distance: f64) -> f64 {
    (last / distance.max(f64::MIN_POSITIVE)).clamp(1.0, MAX_PRIOR_WIDTH)
}

/// How many particles a search of the usual width draws in all, and how many of these in the first round.
pub(crate) fn usual_counts(params: &Params) -> (usize, usize) {
    let all = params.particles as usize;
    match params.search {
        Search::Resampled => (all, all),
        Search::Answer => (all, (all - (REFINED_SHARE * all as f64) as usize).max(1)),
    }
}

/// How many particles the widest search draws in all.
pub(crate) fn max_count(params: &Params) -> usize {
    let (all, first) = usual_counts(params);
    // The paper's evaluation takes N candidates.
    if params.search == Search::Resampled || !params.single_vector_candidate {
        return all;
    }
    let widest = all + (first as f64 * (MAX_DENSITY - 1.0)) as usize;
    widest.min(params.max_particles())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::presets::Preset;

    const BOUNDS: StateBounds = StateBounds {
        frame_width: 100.0,
        frame_height: 80.0,
        box_width: 20.0,
        box_height: 10.0,
    };
    const LAST: Particle = Particle {
        x: 50.0,
        y: 40.0,
        scale: 1.0,
    };

    fn search(params: &Params, spread: f64) -> SearchContext<'_> {
        SearchContext {
            last: LAST,
            displacement: (0.0, 0.0),
            rotation: None,
            spread,
            samples_radius: 0.0,
            params,
            bounds: &BOUNDS,
        }
    }

    #[test]
    fn the_widest_search_costs_no_more_than_parameters_may() {
        let max = |params: &Params| {
            assert_eq!(params.validate(), Ok(()));
            assert_eq!(search(params, MAX_DENSITY).counts().0, max_count(params));
            max_count(params)
        };
        let robust = Preset::Robust.params();
        assert_eq!(max(&robust), 500);
        let large = |particles, side, background_samples| Params {
            particles,
            patch_width: side,
            patch_height: side,
            background_samples,
            ..robust.clone()
        };
        // The count is limited by the number of particles, by their values, by their products with the background; the
        // last parameters are at the limit already.
        for (params, expected) in [
            (large(600, 8, 64), 1000),
            (large(200, 20, 32), 229),
            (large(600, 8, 200), 666),
            (large(45, 45, 0), 45),
        ] {
            let max = max(&params);
            assert_eq!(max, expected);
            let widest = Params {
                particles: max as u32,
                ..params.clone()
            };
            assert_eq!(widest.validate(), Ok(()));
        }
    }

    #[test]
    fn only_a_place_nearer_the_first_image_may_be_further_away() {
        assert_eq!(prior_width(0.0, 0.0), 1.0);
        assert_eq!(prior_width(0.3, 0.5), 1.0);
        assert_eq!(prior_width(0.45, 0.3), 1.5);
        assert_eq!(prior_width(0.5, 0.0), MAX_PRIOR_WIDTH);
    }

    #[test]
    fn a_prior_of_any_width_is_greatest_at_the_last_answer_and_falls() {
        for std in [0.0, 5e-324, 1e-200, 1e-3, 12.0] {
            let params = Params {
                displacement_std: std,
                ..Preset::Robust.params()
            };
            let search = search(&params, 1.0);
            assert_eq!(search.log_prior(&LAST, 1.0), 0.0, "{std}");
            let prior = search.log_prior(&Particle { x: 53.0, ..LAST }, 1.0);
            let falls = if std > 0.0 { prior < 0.0 } else { prior == 0.0 };
            assert!(falls, "{std}: {prior}");
        }
    }
}
