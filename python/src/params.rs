//! Keyword arguments to the tracker's parameters.

use bagtrack_tracker::{Params, Preset};
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use serde_json::{Map, Value};

/// Seeds drawn here are below this, so that JSON numbers hold them exactly in every language.
const SEED_END: u64 = 1 << 53;

/// The seed in an argument: one that is not in its range is a `ValueError`, as with other parameters.
///
/// # Errors
/// It is no whole number, or not in its range.
pub fn extract_seed(value: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    let seed: PyResult<Option<u64>> = value.extract();
    match seed {
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => {
            Err(PyValueError::new_err(format!(
                "the seed is a whole number from 0 to {}, not {value}",
                u64::MAX
            )))
        }
        seed => seed,
    }
}

/// The parameters of `preset` with single ones set otherwise. Where the seed is None, one is drawn from Python's
/// `random`.
///
/// # Errors
/// There is no such preset or parameter, or a value is of the wrong type or out of its range.
pub fn params(
    preset: &str,
    seed: Option<u64>,
    single: Option<&Bound<'_, PyDict>>,
    py: Python<'_>,
) -> PyResult<Params> {
    let preset: Preset = serde_json::from_value(preset.into()).map_err(|_| {
        PyValueError::new_err(format!("the preset is robust or paper, not {preset:?}"))
    })?;
    let mut params = preset.params();
    for (name, value) in single.into_iter().flatten() {
        params = with(&params, name.extract()?, &value)?;
    }
    params.seed = match seed {
        Some(seed) => seed,
        None => py
            .import("random")?
            .call_method1("randrange", (SEED_END,))?
            .extract()?,
    };
    params
        .validate()
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(params)
}

/// Each parameter's value by its name.
pub fn by_name(params: &Params, py: Python<'_>) -> PyResult<Py<PyDict>> {
    let dict = PyDict::new(py);
    let fields = fields(params);
    for row in Params::TABLE {
        let value = &fields[row.name];
        match value.as_u64() {
            Some(whole) => dict.set_item(row.name, whole)?,
            None => dict.set_item(row.name, value.as_f64())?,
        }
    }
    Ok(dict.unbind())
}

fn with(params: &Params, name: String, value: &Bound<'_, PyAny>) -> PyResult<Params> {
    let mut fields = fields(params);
    let known: Vec<&str> = Params::TABLE.iter().map(|row| row.name).collect();
    if !known.contains(&&*name) {
        return Err(PyTypeError::new_err(format!(
            "there is no parameter {name}; the parameters are {}",
            known.join(", ")
        )));
    }
    fields.insert(name.clone(), json(value)?);
    serde_json::from_value(Value::Object(fields)).map_err(|error| {
        let value = value
            .repr()
            .map_or_else(|_| "that".into(), |it| it.to_string());
        PyValueError::new_err(format!("parameter {name} cannot be {value}: {error}"))
    })
}

fn fields(params: &Params) -> Map<String, Value> {
    match serde_json::to_value(params) {
        Ok(Value::Object(fields)) => fields,
        _ => unreachable!("the parameters are a struct of numbers, truth values and names"),
    }
}

/// A number, truth value or text. Whole numbers may be given as floats; NumPy's numbers are taken, too.
fn json(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(truth.is_true().into());
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(text.into());
    }
    if let Ok(whole) = value.extract::<u64>() {
        return Ok(whole.into());
    }
    let number: f64 = value.extract()?;
    let is_whole = number.fract() == 0.0 && (0.0..=SEED_END as f64).contains(&number);
    Ok(match is_whole {
        true => (number as u64).into(),
        false => number.into(),
    })
}
