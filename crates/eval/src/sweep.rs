//! Sweeps: variants that a person wrote into a text file.

use super::variant::Variant;
use bagtrack_cli::{AssignError, Assignment, parse_assignment};
use bagtrack_tracker::Params;

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
    use bagtrack_tracker::Preset;

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
