//! What a new track begins with: boxes, and a preset with single parameters set otherwise.

use crate::http::problems::problem::Problem;
use bagtrack_api::requests::{MAX_EXACT, Seed, whole};
use bagtrack_api::{self as api, Parameters, PresetName};
use bagtrack_sessions::random::random_range;
use bagtrack_sessions::{Boxes, PerTarget};
use bagtrack_tracker::{Params, Preset, Rect};
use serde_json::{Map, Value};

/// The longest list of boxes is as long as a session has targets.
const _: () = assert!(api::MAX_TARGETS == bagtrack_sessions::MAX_TARGETS);

/// A box as the tracker has it.
pub fn rect(target: api::Rect) -> Rect {
    Rect::new(target.x, target.y, target.width, target.height)
}

/// The boxes of a new session's targets.
///
/// # Errors
/// There is neither a box nor a list of boxes, or both.
pub fn boxes(target: Option<api::Rect>, targets: Option<api::Boxes>) -> Result<Boxes, Problem> {
    match (target, targets) {
        (Some(target), None) => Ok(PerTarget::One(rect(target))),
        (None, Some(list)) => {
            let list = list.as_slice().iter().map(|target| rect(*target));
            Ok(PerTarget::List(list.collect()))
        }
        (None, None) => Err(Problem::missing_box()),
        (Some(_), Some(_)) => {
            let detail = "Give `box` for one target or `boxes` for several, not both.";
            Err(Problem::malformed(detail))
        }
    }
}

/// The parameters of these settings: those of the preset or the default one, with single ones set otherwise, and with
/// `seed`, where there is one. Without any seed a random one is drawn.
///
/// # Errors
/// A parameter is unknown or has the wrong type.
pub fn resolve(
    preset: Option<PresetName>,
    seed: Option<Seed>,
    overrides: Option<Parameters>,
) -> Result<Params, Problem> {
    let preset = match preset {
        None => Preset::default(),
        Some(PresetName::Paper) => Preset::Paper,
        Some(PresetName::Robust) => Preset::Robust,
    };
    let mut params = preset.params();
    params.seed = random_range(0..=MAX_EXACT);
    // One at a time, so that a value of the wrong type can be named.
    for (name, value) in overrides.unwrap_or_default().0 {
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
            Problem::invalid_parameter(format!("Parameter `{name}` cannot be {value}: {error}."))
        })?;
    }
    if params.seed > MAX_EXACT {
        let detail = format!("Parameter `seed` must be a whole number from 0 to {MAX_EXACT}.");
        return Err(Problem::invalid_parameter(detail));
    }
    params.seed = seed.map_or(params.seed, |seed| seed.0);
    Ok(params)
}

/// The values of the parameters that users set.
pub fn public(params: &Params) -> Parameters {
    let mut fields = fields(params);
    fields.retain(|name, _| is_public(name));
    Parameters(fields)
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
