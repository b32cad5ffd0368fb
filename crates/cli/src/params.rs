//! Tracker parameters from the command line.
//!
//! `--set` takes every field of [`Params`], so that measurements can switch off the parts of a preset; `--help` lists
//! the parameters of the table.

use crate::assignment::{AssignError, Assignment, assign, parse_assignment};
use bagtrack_tracker::{Parameter, Params, Preset};
use serde_json::Value;

/// Flags that choose the tracker's parameters.
#[derive(Debug, clap::Args)]
#[command(after_long_help = parameter_list())]
pub struct ParamFlags {
    /// The set of parameters: `robust`, or `paper` for the equations as printed.
    #[arg(long, default_value = "robust", value_parser = preset)]
    pub preset: Preset,
    /// Sets one parameter of the preset; may be given several times. `--help` lists the parameters.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_assignment)]
    assignments: Vec<Assignment>,
}

impl ParamFlags {
    /// The preset's parameters with the assignments applied, all in their ranges.
    ///
    /// # Errors
    /// An assignment is wrong, or a value is out of its range; the text is one line.
    pub fn params(&self) -> Result<Params, String> {
        let params = assign(&self.preset.params(), &self.assignments);
        params.map_err(|error| match error {
            AssignError::Range(error) => error.to_string(),
            error => format!("--set {error}"),
        })
    }

    /// A label for these parameters: the preset's name, and the assignments.
    pub fn label(&self) -> String {
        let preset = match self.preset {
            Preset::Paper => "paper",
            Preset::Robust => "robust",
        };
        let set = self.assignments.iter();
        set.fold(preset.to_owned(), |label, (name, value)| {
            format!("{label}, {name}={value}")
        })
    }
}

fn preset(text: &str) -> Result<Preset, String> {
    serde_json::from_value(Value::String(text.to_owned())).map_err(|error| error.to_string())
}

/// The end of the long help: a line for each parameter, so that `grep` finds all about it.
fn parameter_list() -> String {
    let robust = serde_json::to_value(Preset::Robust.params()).unwrap_or_default();
    let rows: Vec<[String; 3]> = Params::TABLE
        .iter()
        .map(|row| {
            let value = robust[row.name].as_f64().unwrap_or_default();
            [row.name.to_owned(), allowed(row), value.to_string()]
        })
        .collect();
    let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
    let widths = [0, 1, 2].map(width);
    let list = "Parameters for --set NAME=VALUE: name, values allowed, value in `robust`, meaning"
        .to_owned();
    rows.iter()
        .zip(Params::TABLE)
        .fold(list, |list, (row, parameter)| {
            let [name, allowed, value] = row;
            let [first, second, third] = widths;
            let meaning = parameter.description.trim();
            format!("{list}\n  {name:first$}  {allowed:second$}  {value:third$}  {meaning}")
        })
}

fn allowed(parameter: &Parameter) -> String {
    match parameter.range {
        Some((min, max)) => format!("{min} to {max}"),
        None => "whole number".to_owned(),
    }
}
