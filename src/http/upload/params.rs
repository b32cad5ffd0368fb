//! A preset with single parameters set otherwise.

use crate::http::problem::Problem;
use crate::tracker::{Params, Preset};
use serde_json::{Map, Value};

/// Seeds made here are below this, so that they survive in JSON numbers of every language.
const SEED_END: u64 = 1 << 53;

/// The parameters of `preset`, with `seed` (a random one when there is none) and `overrides`.
pub fn resolve(
    preset: Preset,
    seed: Option<u64>,
    overrides: Option<&Map<String, Value>>,
) -> Result<Params, Problem> {
    let mut params = preset.params();
    params.seed = seed.unwrap_or_else(|| rand::random_range(0..SEED_END));
    let Some(overrides) = overrides else {
        return Ok(params);
    };
    if seed.is_some() && overrides.contains_key("seed") {
        return Err(Problem::malformed("`seed` is given twice; give it once."));
    }
    // One at a time, so that a value of the wrong type can be named.
    for (name, value) in overrides {
        let mut object = match serde_json::to_value(&params) {
            Ok(Value::Object(object)) => object,
            _ => unreachable!("parameters are a JSON object"),
        };
        if !object.contains_key(name) {
            return Err(unknown(name, &object));
        }
        object.insert(name.clone(), value.clone());
        params = serde_json::from_value(Value::Object(object)).map_err(|error| {
            Problem::invalid_parameter(format!("Parameter `{name}` cannot be {value}: {error}."))
        })?;
    }
    Ok(params)
}

fn unknown(name: &str, known: &Map<String, Value>) -> Problem {
    let names: Vec<String> = known.keys().map(|name| format!("`{name}`")).collect();
    let name: String = name.chars().take(64).collect();
    Problem::invalid_parameter(format!(
        "There is no parameter `{name}`; the parameters are {}.",
        names.join(", ")
    ))
}
