//! Tracker parameters from the command line.

use bagtrack::tracker::{Params, Preset};
use serde_json::Value;

/// Flags that choose the tracker's parameters.
#[derive(Debug, clap::Args)]
pub struct ParamFlags {
    /// The set of parameters: `robust`, or `paper` for the equations as printed.
    #[arg(long, default_value = "robust", value_parser = preset)]
    pub preset: Preset,
    /// Sets one parameter of the preset; may be given several times.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    assignments: Vec<(String, Value)>,
}

impl ParamFlags {
    /// The preset's parameters with the single ones set, all in their ranges.
    pub fn params(&self) -> Result<Params, String> {
        let defaults = self.preset.params();
        let mut fields = serde_json::to_value(&defaults).map_err(|error| error.to_string())?;
        for (name, value) in &self.assignments {
            let Some(field) = fields.get_mut(name) else {
                return Err(unknown(name, &fields));
            };
            *field = value.clone();
            // Checked one by one, so that the message is about the right name.
            serde_json::from_value::<Params>(fields.clone())
                .map_err(|error| format!("--set {name}={value}: {error}"))?;
        }
        let params: Params = serde_json::from_value(fields).map_err(|error| error.to_string())?;
        params.validate().map_err(|error| error.to_string())?;
        Ok(params)
    }
}

fn unknown(name: &str, fields: &Value) -> String {
    let names: Vec<&str> = fields
        .as_object()
        .map(|fields| fields.keys().map(String::as_str).collect())
        .unwrap_or_default();
    format!(
        "--set {name}: there is no such parameter; there are {}",
        names.join(", ")
    )
}

fn preset(text: &str) -> Result<Preset, String> {
    serde_json::from_value(Value::String(text.to_owned())).map_err(|error| error.to_string())
}

/// `name=value`, the value a JSON number or truth value, or else text.
fn assignment(text: &str) -> Result<(String, Value), String> {
    let (name, value) = text.split_once('=').ok_or("it must be NAME=VALUE")?;
    let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
    Ok((name.to_owned(), value))
}
