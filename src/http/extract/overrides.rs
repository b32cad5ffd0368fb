//! A preset with single parameters set otherwise.

use super::settings::{MAX_EXACT, Seed, whole};
use crate::http::problems::problem::Problem;
use bagtrack_sessions::random::random_range;
use bagtrack_tracker::{Params, Preset};
use serde::de::{Deserialize, Deserializer, Error};
use serde_json::{Map, Value};
use std::borrow::Cow;

/// A named set of the tracker's parameters.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, serde::Serialize, utoipa::ToSchema,
)]
#[schema(as = Preset)]
#[serde(rename_all = "snake_case")]
pub enum PresetName {
    /// The equations and numbers of the paper.
    Paper,
    /// The default: extended where the printed equations lose the object.
    Robust,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Paper => Self::Paper,
            PresetName::Robust => Self::Robust,
        }
    }
}

/// Single parameters by their names.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
#[serde(transparent)]
pub struct ParamOverrides(Map<String, Value>);

impl<'de> Deserialize<'de> for ParamOverrides {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        serde_json::from_str(&text).map(Self).map_err(|_| {
            D::Error::custom("`parameters` must be a JSON object of parameters, like {\"seed\": 7}")
        })
    }
}

impl ParamOverrides {
    /// The parameters of `preset` with these overrides, and with `seed`, where there is one. Without any seed a random one
    /// is drawn.
    ///
    /// # Errors
    /// A parameter is unknown or has the wrong type.
    pub fn resolve(self, preset: Preset, seed: Option<Seed>) -> Result<Params, Problem> {
        let mut params = preset.params();
        params.seed = random_range(0..=MAX_EXACT);
        // One at a time, so that a value of the wrong type can be named.
        for (name, value) in self.0 {
            if !is_public(&name) {
                return Err(unknown(&name));
            }
            let mut known = fields(&params);
            let value = match value.as_f64().and_then(whole) {
                Some(whole) if value.is_f64() => Value::from(whole),
                _ => value,
            };
            known.insert(name.clone(), value.clone());
            params = serde_json::from_value(Value::Object(known)).map_err(|error| {
                Problem::invalid_parameter(format!(
                    "Parameter `{name}` cannot be {value}: {error}."
                ))
            })?;
        }
        if params.seed > MAX_EXACT {
            let detail = format!("Parameter `seed` must be a whole number from 0 to {MAX_EXACT}.");
            return Err(Problem::invalid_parameter(detail));
        }
        params.seed = seed.map_or(params.seed, |seed| seed.0);
        Ok(params)
    }
}

/// The parameters of these settings: those of `preset` or the default one, with single ones set otherwise.
///
/// # Errors
/// See [`ParamOverrides::resolve`].
pub fn resolve(
    preset: Option<PresetName>,
    seed: Option<Seed>,
    params: Option<ParamOverrides>,
) -> Result<Params, Problem> {
    let preset = preset.map_or_else(Preset::default, Preset::from);
    let params = params.unwrap_or_default();
    params.resolve(preset, seed)
}

impl From<&Params> for ParamOverrides {
    /// The values of the parameters that users set.
    fn from(params: &Params) -> Self {
        let mut fields = fields(params);
        fields.retain(|name, _| is_public(name));
        Self(fields)
    }
}

impl ParamOverrides {
    /// Removes and returns the value of the parameter `name`.
    pub fn take(&mut self, name: &str) -> Option<Value> {
        self.0.remove(name)
    }
}

/// Whether users set the parameter `name`. The others are the presets' own.
fn is_public(name: &str) -> bool {
    Params::TABLE.iter().any(|row| row.name == name)
}

/// All parameters by their names.
fn fields(params: &Params) -> Map<String, Value> {
    match serde_json::to_value(params) {
        Ok(Value::Object(object)) => object,
        // `Params` is a struct of numbers, booleans and names.
        _ => unreachable!("the parameters are a JSON object"),
    }
}

fn unknown(name: &str) -> Problem {
    let rows = Params::TABLE.iter();
    let names: Vec<String> = rows.map(|row| format!("`{}`", row.name)).collect();
    let name: String = name.chars().take(64).collect();
    Problem::invalid_parameter(format!(
        "There is no parameter `{name}`; the parameters are {}.",
        names.join(", ")
    ))
}
