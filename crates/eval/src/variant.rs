//! Variants: a label, and parameters that differ from those that are evaluated.

use bagtrack_cli::{AssignError, Assignment, assign};
use bagtrack_tracker::{Params, Preset};

/// The name under which a variant takes the parameters of a preset before it sets single ones.
const PRESET: &str = "preset";

/// A named change of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// The variant's name in tables.
    pub label: String,
    /// The parameters that it sets, in order. A first assignment of `preset` takes all parameters of that preset.
    pub assignments: Vec<Assignment>,
}

impl Variant {
    /// The parameters of this variant of `base`, all in their ranges.
    ///
    /// # Errors
    /// An assignment names no parameter, or gives a value that the parameter cannot have.
    pub fn params(&self, base: &Params) -> Result<Params, AssignError> {
        match self.assignments.split_first() {
            Some(((name, value), rest)) if name == PRESET => {
                let preset: Preset =
                    serde_json::from_value(value.clone()).map_err(|error| AssignError::Type {
                        name: name.clone(),
                        value: value.clone(),
                        reason: error.to_string(),
                    })?;
                assign(&preset.params(), rest)
            }
            _ => assign(base, &self.assignments),
        }
    }
}
