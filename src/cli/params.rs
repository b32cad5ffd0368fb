//! Tracker parameters from the command line.

use bagtrack::eval::{self, AssignError, Assignment};
use bagtrack::tracker::{Params, Preset};
use serde_json::Value;

/// Flags that choose the tracker's parameters.
#[derive(Debug, clap::Args)]
pub struct ParamFlags {
    /// The set of parameters: `robust`, or `paper` for the equations as printed.
    #[arg(long, default_value = "robust", value_parser = preset)]
    pub preset: Preset,
    /// Sets one parameter of the preset; may be given several times.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = eval::parse_assignment)]
    assignments: Vec<Assignment>,
}

impl ParamFlags {
    /// The preset's parameters with the single ones set, all in their ranges.
    pub fn params(&self) -> Result<Params, String> {
        let params = eval::assign(&self.preset.params(), &self.assignments);
        params.map_err(|error| match error {
            AssignError::Range(error) => error.to_string(),
            error => format!("--set {error}"),
        })
    }

    /// What these parameters are called: the preset, and what is set.
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
