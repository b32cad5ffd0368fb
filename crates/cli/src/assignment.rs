//! Single parameters, set over a preset: `name=value`.

use bagtrack_tracker::{Params, ParamsError};
use serde_json::Value;

/// Why an assignment is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AssignError {
    /// The text is not `NAME=VALUE`.
    #[error("{0:?}: it must be NAME=VALUE")]
    Form(String),
    /// There is no parameter of this name.
    #[error("{name}: there is no such parameter; there are {names}")]
    Name {
        /// The name given.
        name: String,
        /// The names of all parameters.
        names: String,
    },
    /// The value is not of the parameter's type.
    #[error("{name}={value}: {reason}")]
    Type {
        /// Name of the parameter.
        name: String,
        /// The value given.
        value: Value,
        /// What is wrong with it.
        reason: String,
    },
    /// The values have the right types, but some are out of their ranges.
    #[error(transparent)]
    Range(#[from] ParamsError),
}

/// One assignment of a parameter.
pub type Assignment = (String, Value);

/// Reads `name=value`: the value is a JSON number or truth value, or else text.
///
/// # Errors
/// [`AssignError::Form`].
pub fn parse_assignment(text: &str) -> Result<Assignment, AssignError> {
    let form = || AssignError::Form(text.to_owned());
    let (name, value) = text.split_once('=').ok_or_else(form)?;
    let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
    Ok((name.to_owned(), value))
}

/// `base` with single parameters set, all in their ranges.
///
/// # Errors
/// The first assignment that is wrong, or a value out of its range after all assignments.
pub fn assign(base: &Params, assignments: &[Assignment]) -> Result<Params, AssignError> {
    let mut params = base.clone();
    for (name, value) in assignments {
        let wrong = |error: serde_json::Error| AssignError::Type {
            name: name.clone(),
            value: value.clone(),
            reason: error.to_string(),
        };
        let mut fields = serde_json::to_value(&params).map_err(wrong)?;
        let Some(field) = fields.get_mut(name) else {
            let fields = fields.as_object().into_iter().flatten();
            let names: Vec<&str> = fields.map(|(name, _)| name.as_str()).collect();
            return Err(AssignError::Name {
                name: name.clone(),
                names: names.join(", "),
            });
        };
        *field = value.clone();
        params = serde_json::from_value(fields).map_err(wrong)?;
    }
    params.validate()?;
    Ok(params)
}
