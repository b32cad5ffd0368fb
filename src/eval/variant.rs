//! Variants: a label, and parameters that differ from those that are evaluated.

use crate::tracker::{Params, ParamsError, Preset};
use serde_json::Value;

/// The name under which a variant takes the parameters of a preset before it sets single ones.
const PRESET: &str = "preset";

/// A parameter cannot be set as told.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AssignError {
    /// It is not `NAME=VALUE`.
    #[error("{0:?}: it must be NAME=VALUE")]
    Form(String),
    /// There is no parameter of this name.
    #[error("{name}: there is no such parameter; there are {names}")]
    Name {
        /// The name given.
        name: String,
        /// Those there are.
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
    /// The parameters are of the right types, but out of their ranges.
    #[error(transparent)]
    Range(#[from] ParamsError),
}

/// A line of a sweep, or one of its parameters, is wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A line without a label.
    #[error("line {line} is not `label: name=value name=value`: {text:?}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What it is.
        text: String,
    },
    /// A parameter that cannot be set as told.
    #[error("line {line}: {source}")]
    Assignment {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong.
        source: AssignError,
    },
    /// There is no variant in it.
    #[error("there is no variant in it: one a line, `label: name=value name=value`")]
    Empty,
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
/// The first assignment that is wrong, or the ranges in the end.
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

/// A named change of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// What a table calls it.
    pub label: String,
    /// What it sets, in order. A first assignment of `preset` takes all parameters of that preset.
    pub assignments: Vec<Assignment>,
}

impl Variant {
    /// The parameters of this variant of `base`, all in their ranges.
    ///
    /// # Errors
    /// An assignment that is wrong.
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

/// Reads a sweep: a variant a line, `label: name=value name=value`, each held against `base`. A label alone is
/// `base` itself; `preset=paper` before the others takes that preset. Empty lines and lines that begin with `#` are
/// passed over.
///
/// # Errors
/// The first line that is wrong, by its number.
pub fn parse_sweep(text: &str, base: &Params) -> Result<Vec<Variant>, SweepError> {
    let mut variants = Vec::new();
    for (index, text) in text.lines().enumerate() {
        let (line, text) = (index + 1, text.trim());
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let (label, rest) = text
            .split_once(':')
            .filter(|(label, _)| !label.trim().is_empty())
            .ok_or_else(|| SweepError::Line {
                line,
                text: text.to_owned(),
            })?;
        let wrong = |source| SweepError::Assignment { line, source };
        let assignments = rest.split_whitespace().map(parse_assignment);
        let variant = Variant {
            label: label.trim().to_owned(),
            assignments: assignments
                .collect::<Result<Vec<Assignment>, AssignError>>()
                .map_err(wrong)?,
        };
        variant.params(base).map_err(wrong)?;
        variants.push(variant);
    }
    if variants.is_empty() {
        return Err(SweepError::Empty);
    }
    Ok(variants)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_is_read_line_by_line() {
        let base = Preset::Paper.params();
        let text = "# notes\n\nas it is:\nwide, few: sigma=0.03 particles=50\npaper: preset=paper alpha=1\n";
        let variants = parse_sweep(text, &base).expect("it is in order");
        let labels: Vec<&str> = variants.iter().map(|v| v.label.as_str()).collect();
        assert_eq!(labels, ["as it is", "wide, few", "paper"]);
        assert_eq!(variants[0].params(&base), Ok(base.clone()));
        let wide = variants[1].params(&base).expect("it was read");
        assert_eq!((wide.sigma, wide.particles), (0.03, 50));
        let other = Params {
            history: 2,
            ..base.clone()
        };
        let paper = variants[2].params(&other).expect("it was read");
        assert_eq!((paper.history, paper.alpha), (base.history, 1.0));
    }

    #[test]
    fn a_wrong_line_is_named() {
        let refuse = |text: &str| {
            parse_sweep(text, &Preset::Paper.params())
                .expect_err("it is wrong")
                .to_string()
        };
        assert!(refuse("a:\nno label here\n").contains("line 2"));
        assert!(refuse(": alpha=1").contains("line 1"));
        assert!(refuse("a: alpha").contains("NAME=VALUE"));
        assert!(refuse("a: alhpa=1").contains("there is no such parameter; there are"));
        assert!(refuse("a: alpha=2").contains("from 0 to 1"));
        assert!(refuse("a: particles=many").contains("particles=\"many\""));
        assert!(refuse("a: preset=best").contains("preset=\"best\""));
        assert!(refuse("# nothing\n").contains("no variant"));
    }
}
