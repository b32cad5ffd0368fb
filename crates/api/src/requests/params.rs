//! The tracker's parameters of a request: those of a preset, with single ones set otherwise.

use super::values::{MAX_EXACT, Seed, whole};
use crate::{Parameters, PresetName};
use bagtrack_tracker::{Params, Preset};
use serde_json::{Map, Value};

/// Why parameters are refused, as a sentence for the user.
#[derive(Debug, thiserror::Error)]
pub enum ParamsError {
    /// There is no parameter of this name.
    #[error("There is no parameter `{name}`; the parameters are {}.", names())]
    Unknown {
        /// The name, cut off after 64 characters.
        name: String,
    },
    /// The value has not the parameter's type.
    #[error("Parameter `{name}` cannot be {value}: {reason}.")]
    WrongType {
        /// The parameter.
        name: String,
        /// Its value.
        value: Value,
        /// What is wrong with it.
        reason: serde_json::Error,
    },
    /// The seed is greater than JSON holds exactly.
    #[error("Parameter `seed` must be a whole number from 0 to {MAX_EXACT}.")]
    Seed,
}

/// The parameters of a request: those of the preset (or of the default one), changed by `overrides`. The seed is
/// `seed`, else that of `overrides`, else `random_seed`.
///
/// # Errors
/// A parameter is unknown or has the wrong type, or the seed is too great.
pub fn resolve_params(
    preset: Option<PresetName>,
    seed: Option<Seed>,
    overrides: Option<Parameters>,
    random_seed: u64,
) -> Result<Params, ParamsError> {
    let preset = match preset {
        None => Preset::default(),
        Some(PresetName::Paper) => Preset::Paper,
        Some(PresetName::Robust) => Preset::Robust,
    };
    let mut params = preset.params();
    params.seed = random_seed;
    // One at a time, so that the error can name the parameter with the wrong type.
    for (name, value) in overrides.unwrap_or_default().0 {
        if !is_public(&name) {
            let name = name.chars().take(64).collect();
            return Err(ParamsError::Unknown { name });
        }
        let mut known = fields(&params);
        let value = match value.as_f64().and_then(whole) {
            Some(whole) if value.is_f64() => Value::from(whole),
            _ => value,
        };
        known.insert(name.clone(), value.clone());
        params = serde_json::from_value(Value::Object(known)).map_err(|reason| {
            ParamsError::WrongType {
                name,
                value,
                reason,
            }
        })?;
    }
    if params.seed > MAX_EXACT {
        return Err(ParamsError::Seed);
    }
    params.seed = seed.map_or(params.seed, |seed| seed.0);
    Ok(params)
}

/// The values of the parameters that users may set.
pub fn public_params(params: &Params) -> Parameters {
    let mut fields = fields(params);
    fields.retain(|name, _| is_public(name));
    Parameters(fields)
}

/// Whether users may set the parameter `name`. All others are set by the presets alone.
fn is_public(name: &str) -> bool {
    Params::TABLE.iter().any(|row| row.name == name)
}

/// All parameters by their names, those of the presets alone included.
fn fields(params: &Params) -> Map<String, Value> {
    match serde_json::to_value(params) {
        Ok(Value::Object(object)) => object,
        // `Params` is a struct of numbers, booleans and names.
        _ => unreachable!("the parameters are a JSON object"),
    }
}

/// The names of the parameters that users may set.
fn names() -> String {
    let rows = Params::TABLE.iter();
    let names: Vec<String> = rows.map(|row| format!("`{}`", row.name)).collect();
    names.join(", ")
}
