//! The parameters, with their symbols in the paper.

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
        todo!()
    }
}

/// Every parameter of the tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// Seed of all random draws.
    pub seed: u64,
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
