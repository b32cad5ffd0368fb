//! The ranges of the parameters.
//!
//! Every range has an upper end, and so has the product of the sizes, so that no choice of parameters makes one session
//! cost more than some fifty milliseconds a frame or keep more than a few megabytes.

use std::ops::RangeInclusive;

use crate::tracker::params::table::Params;

/// A parameter out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameter {name} is {value}; it must be {expected}")]
pub struct ParamsError {
    /// The parameter's field name.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
    /// The range it must be in.
    pub expected: &'static str,
}

/// The greatest N.
const MAX_PARTICLES: u32 = 1000;

/// Most numbers in the vectors of one frame's candidates: N · D.
const MAX_CANDIDATE_VALUES: usize = 1_100_000;

/// Most numbers that a session keeps: those of the full bag and of the background.
const MAX_KEPT_VALUES: u64 = 1_000_000;
/// Most products with the background in a frame: of its samples with all candidates, and with all looks in the bag when
/// it is refreshed.
const MAX_WHITENED_VALUES: u64 = 110_000_000;

impl Params {
    /// Checks every parameter against its range. NaN and infinities are out of every range.
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn validate(&self) -> Result<(), ParamsError> {
        count(
            "particles",
            self.particles,
            1..=MAX_PARTICLES,
            "from 1 to 1000",
        )?;
        count("patch_width", self.patch_width, 4..=64, "from 4 to 64")?;
        count("patch_height", self.patch_height, 4..=64, "from 4 to 64")?;
        count("basis_dim", self.basis_dim, 1..=6, "from 1 to 6")?;
        count("history", self.history, 1..=10, "from 1 to 10")?;
        count("bag_size", self.bag_size, 1..=32, "from 1 to 32")?;
        count(
            "update_every",
            self.update_every,
            1..=1000,
            "from 1 to 1000",
        )?;
        count(
            "background_samples",
            self.background_samples,
            0..=256,
            "from 0 to 256",
        )?;
        count(
            "background_every",
            self.background_every,
            1..=1000,
            "from 1 to 1000",
        )?;
        count("refined_modes", self.refined_modes, 1..=50, "from 1 to 50")?;
        count("dense_maxima", self.dense_maxima, 0..=16, "from 0 to 16")?;
        count("pinned", self.pinned, 0..=16, "from 0 to 16")?;
        real("alpha", self.alpha, 0.0..=1.0, "from 0 to 1")?;
        real("sigma", self.sigma, 0.0001..=100.0, "from 0.0001 to 100")?;
        real(
            "motion_std_x",
            self.motion_std_x,
            0.0..=320.0,
            "from 0 to 320",
        )?;
        real(
            "motion_std_y",
            self.motion_std_y,
            0.0..=320.0,
            "from 0 to 320",
        )?;
        real(
            "motion_std_scale",
            self.motion_std_scale,
            0.0..=1.0,
            "from 0 to 1",
        )?;
        real("context", self.context, 0.5..=3.0, "from 0.5 to 3")?;
        real("gray_weight", self.gray_weight, 0.0..=3.0, "from 0 to 3")?;
        real(
            "background_ridge",
            self.background_ridge,
            0.001..=1000.0,
            "from 0.001 to 1000",
        )?;
        real(
            "refined_share",
            self.refined_share,
            0.0..=0.9,
            "from 0 to 0.9",
        )?;
        real(
            "refined_std",
            self.refined_std,
            0.0..=320.0,
            "from 0 to 320",
        )?;
        real(
            "refined_std_scale",
            self.refined_std_scale,
            0.0..=1.0,
            "from 0 to 1",
        )?;
        real(
            "displacement_std",
            self.displacement_std,
            0.0..=1000.0,
            "from 0 to 1000",
        )?;
        real(
            "scale_change_std",
            self.scale_change_std,
            0.0..=10.0,
            "from 0 to 10",
        )?;
        real("scale_std", self.scale_std, 0.0..=10.0, "from 0 to 10")?;
        real("dense_radius", self.dense_radius, 0.0..=4.0, "from 0 to 4")?;
        real(
            "prune_margin",
            self.prune_margin,
            0.0..=1000.0,
            "from 0 to 1000",
        )?;
        real(
            "scale_learning_rate",
            self.scale_learning_rate,
            0.0..=1.0,
            "from 0 to 1",
        )?;
        real(
            "lost_threshold",
            self.lost_threshold,
            0.0..=1.0,
            "from 0 to 1",
        )?;
        real(
            "static_penalty",
            self.static_penalty,
            0.0..=100.0,
            "from 0 to 100",
        )?;
        real(
            "averaging_radius",
            self.averaging_radius,
            0.0..=100.0,
            "from 0 to 100",
        )?;
        real(
            "augmentation_angle",
            self.augmentation_angle,
            0.0..=90.0,
            "from 0 to 90",
        )?;
        real(
            "rotation_step",
            self.rotation_step,
            0.0..=30.0,
            "from 0 to 30",
        )?;
        real(
            "pinned_weight",
            self.pinned_weight,
            0.0..=100.0,
            "from 0 to 100",
        )?;
        real(
            "update_distance_ratio",
            self.update_distance_ratio,
            0.0..=100.0,
            "from 0 to 100",
        )?;
        real(
            "update_min_score",
            self.update_min_score,
            0.0..=1.0,
            "from 0 to 1",
        )?;
        real(
            "discriminant_weight",
            self.discriminant_weight,
            0.0..=100.0,
            "from 0 to 100",
        )?;
        real(
            "discriminant_damping",
            self.discriminant_damping,
            0.001..=1000.0,
            "from 0.001 to 1000",
        )?;
        if self.particles as usize * self.feature_len() > MAX_CANDIDATE_VALUES {
            return Err(ParamsError {
                name: "particles",
                value: f64::from(self.particles),
                expected: "fewer for patches of this size: particles times feature length is at most 1100000",
            });
        }
        count(
            "pinned",
            self.pinned,
            0..=self.bag_size - 1,
            "less than bag_size",
        )?;
        self.validate_products()
    }

    /// The most particles with which these parameters, which are valid, would still be: no search may have more.
    pub(crate) fn most_particles(&self) -> usize {
        let len = self.feature_len();
        let samples = self.background_samples as usize;
        let templates = self.bag_size as usize * (self.history as usize + 1);
        let compared = (MAX_WHITENED_VALUES as usize)
            .checked_div(samples * len)
            .map_or(usize::MAX, |most| most - templates);
        (MAX_PARTICLES as usize)
            .min(MAX_CANDIDATE_VALUES / len)
            .min(compared)
    }

    /// Checks what sizes cost together. No product overflows once each size is in its range.
    fn validate_products(&self) -> Result<(), ParamsError> {
        let len = self.feature_len() as u64;
        let [samples, bag, columns, patches, particles] = [
            self.background_samples,
            self.bag_size,
            self.basis_dim + 1,
            self.history + 1,
            self.particles,
        ]
        .map(u64::from);
        if (bag * columns + samples) * len > MAX_KEPT_VALUES {
            return Err(ParamsError {
                name: "bag_size",
                value: f64::from(self.bag_size),
                expected: "smaller for patches of this size: (bag_size times (basis_dim + 1) + background_samples) \
                           times feature length is at most 1000000",
            });
        }
        if samples * (particles + bag * patches) * len > MAX_WHITENED_VALUES {
            return Err(ParamsError {
                name: "background_samples",
                value: f64::from(self.background_samples),
                expected: "fewer for so much to compare: background_samples times (particles + bag_size times \
                           (history + 1)) times feature length is at most 110000000",
            });
        }
        Ok(())
    }
}

fn count(
    name: &'static str,
    value: u32,
    range: RangeInclusive<u32>,
    expected: &'static str,
) -> Result<(), ParamsError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(ParamsError {
        name,
        value: f64::from(value),
        expected,
    })
}

fn real(
    name: &'static str,
    value: f64,
    range: RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), ParamsError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(ParamsError {
        name,
        value,
        expected,
    })
}
