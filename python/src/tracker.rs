//! The class `bagtrack.Tracker`.

use super::frame::frame;
use super::model::PyNanoTrack;
use super::params::{by_name, extract_seed, params};
use super::target::{Numbers, box_in, extract_target, numbers};
use bagtrack_tracker::{Estimate, Expert, Params, Search, Status, Tracker, TrackerError};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple, PyType};
use std::sync::{Arc, Mutex, MutexGuard};

/// Follows one object through frames, in this process.
#[pyclass(name = "Tracker", module = "bagtrack", frozen)]
pub struct PyTracker {
    params: Params,
    /// The network of a second opinion, where there is one.
    model: Option<Py<PyNanoTrack>>,
    /// None before `init`.
    tracker: Mutex<Option<Tracker>>,
}

fn value_error(error: TrackerError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

impl PyTracker {
    /// The tracker, once no other thread is at it.
    fn lock(&self) -> PyResult<MutexGuard<'_, Option<Tracker>>> {
        let poisoned = |_| PyRuntimeError::new_err("an earlier call failed; make a new tracker");
        self.tracker.lock().map_err(poisoned)
    }

    /// Changes the tracker, or leaves it as it was, while other threads of Python go on.
    fn change<T: Send>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut Tracker) -> Result<T, TrackerError> + Send,
    ) -> PyResult<T> {
        py.detach(|| match self.lock()?.as_mut() {
            Some(tracker) => change(tracker).map_err(value_error),
            None => Err(before_init()),
        })
    }

    fn estimate(&self, py: Python<'_>) -> PyResult<Estimate> {
        self.change(py, |tracker| Ok(tracker.estimate()))
    }
}

fn expert(model: Option<&Py<PyNanoTrack>>) -> Option<Arc<dyn Expert>> {
    model.map(|model| model.get().expert())
}

fn before_init() -> PyErr {
    PyRuntimeError::new_err("the tracker has no target yet: call init(frame, box) first")
}

#[pymethods]
impl PyTracker {
    #[new]
    #[pyo3(signature = (preset = "robust", seed = Some(0), *, model = None, **params))]
    fn new(
        py: Python<'_>,
        preset: &str,
        #[pyo3(from_py_with = extract_seed)] seed: Option<u64>,
        model: Option<Py<PyNanoTrack>>,
        params: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        Ok(Self {
            params: self::params(preset, seed, params, py)?,
            model,
            tracker: Mutex::new(None),
        })
    }

    /// Starts on `frame` with the target in `box`; whatever was followed before is forgotten.
    fn init(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let frame = self::frame(frame)?;
        let target = box_in(&frame, r#box)?;
        let expert = expert(self.model.as_ref());
        py.detach(|| {
            let tracker = Tracker::beside(&frame, target, self.params.clone(), expert);
            let tracker = tracker.map_err(value_error)?;
            *self.lock()? = Some(tracker);
            Ok(())
        })
    }

    /// A tracker without a target, for one of several that see the same frames, counted from 0.
    fn of_target(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = extract_target)] target: usize,
    ) -> Self {
        Self {
            params: self.params.of_target(target),
            model: self.model.as_ref().map(|model| model.clone_ref(py)),
            tracker: Mutex::new(None),
        }
    }

    /// Finds the target in the next frame: `(ok, box)`. `ok` is False where the target is lost; `box` is the best guess
    /// then.
    fn update(&self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<(bool, Numbers)> {
        let frame = self::frame(frame)?;
        let estimate = self.change(py, |tracker| tracker.step(&frame))?;
        Ok((estimate.status != Status::Lost, numbers(&estimate.target)))
    }

    /// The user corrects the box: `frame` counts as the next one, with `box` as its answer.
    fn retarget(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let frame = self::frame(frame)?;
        let target = box_in(&frame, r#box)?;
        self.change(py, |tracker| tracker.retarget(&frame, target))?;
        Ok(())
    }

    /// The last answer: (x, y, width, height).
    #[getter]
    fn r#box(&self, py: Python<'_>) -> PyResult<Numbers> {
        Ok(numbers(&self.estimate(py)?.target))
    }

    /// The chance, from 0 to 1, that the box overlaps the target by half or more.
    #[getter]
    fn score(&self, py: Python<'_>) -> PyResult<f64> {
        let score = self.estimate(py)?.score;
        // The shortest decimal that means this score, as the service sends it.
        let decimal = score.to_string().parse();
        Ok(decimal.expect("a finite number is written so that it can be read"))
    }

    /// "tracking", "uncertain" or "lost".
    #[getter]
    fn status(&self, py: Python<'_>) -> PyResult<&'static str> {
        Ok(match self.estimate(py)?.status {
            Status::Tracking => "tracking",
            Status::Uncertain => "uncertain",
            Status::Lost => "lost",
        })
    }

    /// The number of the last frame; the first is 0.
    #[getter]
    fn frame(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.estimate(py)?.frame)
    }

    /// Width and height of the frames.
    #[getter]
    fn frame_size(&self, py: Python<'_>) -> PyResult<(u32, u32)> {
        self.change(py, |tracker| Ok(tracker.source_size()))
    }

    /// All parameters by their names.
    #[getter]
    fn params(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        by_name(&self.params, py)
    }

    /// The whole state as bytes.
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let snapshot = self.change(py, |tracker| Ok(tracker.snapshot()))?;
        Ok(PyBytes::new(py, &snapshot))
    }

    /// A tracker that goes on from what `save` gave, bit for bit.
    #[classmethod]
    #[pyo3(signature = (snapshot, model = None))]
    fn load(
        _: &Bound<'_, PyType>,
        py: Python<'_>,
        snapshot: &[u8],
        model: Option<Py<PyNanoTrack>>,
    ) -> PyResult<Self> {
        let expert = expert(model.as_ref());
        let tracker = py
            .detach(|| Tracker::restore_beside(snapshot, expert))
            .map_err(value_error)?;
        Ok(Self {
            params: tracker.params().clone(),
            model,
            tracker: Mutex::new(Some(tracker)),
        })
    }

    /// What pickle and copy make another one with: `load` and a snapshot, or the parameters before `init`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let tracker = slf.get();
        let is_begun = py.detach(|| Ok::<_, PyErr>(tracker.lock()?.is_some()))?;
        match is_begun {
            true => {
                let snapshot = tracker.save(py)?;
                let load = slf.get_type().getattr("load")?;
                (load, (snapshot, &tracker.model)).into_pyobject(py)
            }
            false => {
                let partial = py.import("functools")?.getattr("partial")?;
                let keywords = by_name(&tracker.params, py)?;
                keywords.bind(py).set_item("model", &tracker.model)?;
                // The presets own what the parameters do not tell.
                let preset = match tracker.params.search {
                    Search::Resampled => "paper",
                    Search::Answer => "robust",
                };
                let make = partial.call((slf.get_type(), preset), Some(keywords.bind(py)))?;
                (make, PyTuple::empty(py)).into_pyobject(py)
            }
        }
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        match self.estimate(py) {
            Ok(estimate) => format!(
                "<bagtrack.Tracker frame={} box={:?}>",
                estimate.frame,
                numbers(&estimate.target)
            ),
            Err(_) => "<bagtrack.Tracker without a target>".to_owned(),
        }
    }
}
