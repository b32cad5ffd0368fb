//! The class `bagtrack._native.KeyFrames`.

use super::target::rect;
use bagtrack_tracker::KeyFrames;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard};

/// Picks the key frames of a track.
#[pyclass(name = "KeyFrames", module = "bagtrack._native", frozen)]
pub struct PyKeyFrames(Mutex<KeyFrames<Py<PyAny>>>);

impl PyKeyFrames {
    fn lock(&self) -> PyResult<MutexGuard<'_, KeyFrames<Py<PyAny>>>> {
        let poisoned = |_| PyRuntimeError::new_err("an earlier call failed");
        self.0.lock().map_err(poisoned)
    }
}

#[pymethods]
impl PyKeyFrames {
    #[new]
    fn new(tolerance: f64) -> Self {
        Self(Mutex::new(KeyFrames::new(tolerance)))
    }

    /// Takes the next box, and gives the rows of the key frames that are certain now.
    fn push(
        &self,
        r#box: &Bound<'_, PyAny>,
        is_shown: bool,
        row: Py<PyAny>,
    ) -> PyResult<Vec<Py<PyAny>>> {
        let target = rect(r#box)?;
        Ok(self.lock()?.push(target, is_shown, row).collect())
    }

    /// The row of the last key frame, if it was not given yet.
    fn finish(&self) -> PyResult<Option<Py<PyAny>>> {
        Ok(self.lock()?.finish())
    }
}
