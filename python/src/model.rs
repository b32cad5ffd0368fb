//! The class `bagtrack.NanoTrack`.

use bagtrack_siamese::NanoTrack;
use bagtrack_tracker::{Expert, InDoubt};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

/// A network that gives trackers a second opinion. Trackers share it.
#[pyclass(name = "NanoTrack", module = "bagtrack", frozen)]
pub struct PyNanoTrack {
    backbone: PathBuf,
    head: PathBuf,
    in_doubt: bool,
    expert: Arc<dyn Expert>,
}

impl PyNanoTrack {
    /// The network as the trackers take it.
    pub fn expert(&self) -> Arc<dyn Expert> {
        self.expert.clone()
    }
}

#[pymethods]
impl PyNanoTrack {
    #[new]
    #[pyo3(signature = (backbone, head, in_doubt = false))]
    fn new(py: Python<'_>, backbone: PathBuf, head: PathBuf, in_doubt: bool) -> PyResult<Self> {
        let network = py.detach(|| load(&backbone, &head))?;
        let network: Arc<dyn Expert> = Arc::new(network);
        let expert = match in_doubt {
            true => Arc::new(InDoubt(network)),
            false => network,
        };
        Ok(Self {
            backbone,
            head,
            in_doubt,
            expert,
        })
    }

    /// What pickle and copy make another one with: the same files.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyType>, (PathBuf, PathBuf, bool)) {
        let model = slf.get();
        let files = (model.backbone.clone(), model.head.clone(), model.in_doubt);
        (slf.get_type(), files)
    }

    fn __repr__(&self) -> String {
        let (backbone, head) = (self.backbone.display(), self.head.display());
        format!("<bagtrack.NanoTrack {backbone} {head}>")
    }
}

/// The network in two files. `OSError` for a file that cannot be read, `ValueError` for one that is no such network.
fn load(backbone: &Path, head: &Path) -> PyResult<NanoTrack> {
    let read = |path: &Path| {
        fs::read(path)
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))
    };
    NanoTrack::from_onnx(&read(backbone)?, &read(head)?).map_err(|error| {
        let (backbone, head) = (backbone.display(), head.display());
        PyValueError::new_err(format!("{backbone} and {head} are no NanoTrack: {error}"))
    })
}
