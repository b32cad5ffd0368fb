//! Parameters by their names, as the service takes them.

use bagtrack_tracker::{Params, Preset};
use wasm_bindgen::prelude::*;

/// The parameters of a tracker.
#[wasm_bindgen(js_name = Parameters)]
#[derive(Debug)]
pub struct WasmParameters(pub(crate) Params);

#[wasm_bindgen(js_class = Parameters)]
impl WasmParameters {
    /// Those of the preset `robust` or `paper`.
    ///
    /// # Errors
    /// There is no such preset.
    #[wasm_bindgen(constructor)]
    pub fn new(preset: &str) -> Result<WasmParameters, JsError> {
        match preset {
            "robust" => Ok(Self(Preset::Robust.params())),
            "paper" => Ok(Self(Preset::Paper.params())),
            _ => Err(JsError::new("the preset must be `robust` or `paper`")),
        }
    }

    /// The names of all that can be set.
    pub fn names() -> Vec<String> {
        let rows = Params::TABLE.iter();
        rows.map(|row| row.name.to_owned()).collect()
    }

    /// The value of a parameter; undefined where there is no such one.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.0.value(name)
    }

    /// Sets a parameter. Its range is checked when a tracker starts.
    ///
    /// # Errors
    /// There is no such parameter, or it is a whole number and `value` is none.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), JsError> {
        if self.0.set(name, value).is_some() {
            return Ok(());
        }
        Err(JsError::new(&match self.0.value(name) {
            Some(_) => format!("`{name}` must be a whole number from 0 on"),
            None => format!("there is no parameter `{name}`"),
        }))
    }
}
