//! The tracker's parameters in a request: a preset, and single parameters that differ from it.

use serde::de::{Deserialize, Deserializer, Error};
use serde_json::{Map, Value};

/// A named set of the tracker's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema), schema(as = Preset))]
#[serde(rename_all = "snake_case")]
pub enum PresetName {
    /// The equations and numbers of the paper.
    Paper,
    /// The default: extended where the printed equations lose the object.
    Robust,
}

/// Single parameters by their names. Read from a JSON object, or from a string with the text of one.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
#[serde(transparent)]
pub struct Parameters(pub Map<String, Value>);

impl Parameters {
    /// The seed of all random draws, where there is one.
    pub fn seed(&self) -> Option<u64> {
        self.0.get("seed")?.as_u64()
    }
}

impl<'de> Deserialize<'de> for Parameters {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let parameters = match Value::deserialize(deserializer)? {
            Value::Object(parameters) => Some(parameters),
            Value::String(text) => serde_json::from_str(&text).ok(),
            _ => None,
        };
        parameters.map(Self).ok_or_else(|| {
            D::Error::custom("`parameters` must be a JSON object of parameters, like {\"seed\": 7}")
        })
    }
}
