//! The parameters, with their symbols in the paper.
//!
//! Every range has an upper end, so that no choice of parameters makes one session cost more than some fifty
//! milliseconds a frame or keep more than a few megabytes.

use serde::{Deserialize, Serialize};

/// A named set of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// The equations and numbers as printed in the paper.
    Paper,
    /// The default: mended where the printed equations lose the object.
    #[default]
    Robust,
}

impl Preset {
    /// The parameters of this preset.
    pub fn params(self) -> Params {
        match self {
            // No mend has been measured to pay yet: both are the paper's.
            Self::Paper | Self::Robust => Params {
                particles: 100,
                patch_width: 32,
                patch_height: 32,
                basis_dim: 3,
                history: 5,
                bag_size: 10,
                update_every: 5,
                alpha: 0.5,
                sigma: 0.01,
                motion_std_x: 5.0,
                motion_std_y: 5.0,
                motion_std_scale: 0.01,
                seed: 0,
            },
        }
    }
}

/// Every parameter of the tracker. Lengths are in pixels of the working image
/// ([`WORKING_SIDE`](super::WORKING_SIDE)).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// N, the number of particles (section III-A), 1 to 1000.
    pub particles: u32,
    /// H₁, the width in pixels to which a candidate area is resized (section III-B), 4 to 64.
    pub patch_width: u32,
    /// H₂, the height in pixels to which a candidate area is resized (section III-B), 4 to 64.
    pub patch_height: u32,
    /// n, the number of basis vectors of an affine subspace (equation 1), 1 to 6. At most P + 1 of them exist.
    pub basis_dim: u32,
    /// P, the number of previous tracked patches in a candidate's subspace (equation 2), 1 to 10.
    pub history: u32,
    /// K, the number of subspaces in the full bag (equation 3), 1 to 32.
    pub bag_size: u32,
    /// W, the number of frames from one update of the bag to the next (section III-C), 1 to 1000.
    pub update_every: u32,
    /// α, the weight of the distance of origins against that of bases (equation 4), 0 to 1.
    pub alpha: f64,
    /// σ, the distance at which a likelihood has fallen to 1/e (equation 11), 0.0001 to 100.
    pub sigma: f64,
    /// Standard deviation of the Brownian motion along x, in pixels a frame (section III-A), 0 to 320.
    pub motion_std_x: f64,
    /// Standard deviation of the Brownian motion along y, in pixels a frame (section III-A), 0 to 320.
    pub motion_std_y: f64,
    /// Standard deviation of the Brownian motion of the scale, a frame (section III-A), 0 to 1. The scale of the
    /// first box is 1.
    pub motion_std_scale: f64,
    /// Seed of all random draws: the same seed and frames give the same boxes.
    pub seed: u64,
}

impl Default for Params {
    fn default() -> Self {
        Preset::default().params()
    }
}

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

impl Params {
    /// Checks every parameter against its range. NaN and infinities are out of every range.
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn validate(&self) -> Result<(), ParamsError> {
        count("particles", self.particles, 1..=1000, "from 1 to 1000")?;
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
        real("alpha", self.alpha, 0.0..=1.0, "from 0 to 1")?;
        real("sigma", self.sigma, 1e-4..=100.0, "from 0.0001 to 100")?;
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
        )
    }

    /// D, the length of a feature vector.
    pub fn feature_len(&self) -> usize {
        self.patch_width as usize * self.patch_height as usize
    }
}

fn count(
    name: &'static str,
    value: u32,
    range: std::ops::RangeInclusive<u32>,
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
    range: std::ops::RangeInclusive<f64>,
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
