//! Boxes: four numbers in Python, a rectangle in Rust.

use bagtrack_tracker::{Frame, Rect, box_warnings, check_box};
use pyo3::exceptions::{PyOverflowError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use std::ffi::CString;

/// x, y, width and height in pixels of the frame, as OpenCV has them.
pub type Numbers = (f64, f64, f64, f64);

/// The box in this frame of a sequence of four numbers. One of which half lies outside is warned of.
///
/// # Errors
/// Anything else, or a box that cannot be meant: two corners, or shares of the frame.
pub fn box_in(frame: &Frame, object: &Bound<'_, PyAny>) -> PyResult<Rect> {
    let (target, size) = (rect(object)?, frame.source_size());
    check_box(&target, size).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let py = object.py();
    for warning in box_warnings(&[target], size).unwrap_or_default() {
        let text = CString::new(warning).expect("a warning has no zero byte");
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(target)
}

/// The rectangle of a sequence of four numbers.
///
/// # Errors
/// Anything else.
pub fn rect(object: &Bound<'_, PyAny>) -> PyResult<Rect> {
    let numbers = object.try_iter().and_then(|items| {
        let items: PyResult<Vec<f64>> = items.map(|item| item?.extract()).collect();
        items
    });
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) => Ok(Rect::new(x, y, width, height)),
        _ => Err(PyValueError::new_err(
            "a box is four numbers: x, y, width, height",
        )),
    }
}

/// The number of a target: one below 0 is a `ValueError`, as other arguments out of their range.
///
/// # Errors
/// It is no whole number, or not in its range.
pub fn extract_target(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    value.extract().map_err(|error: PyErr| {
        match error.is_instance_of::<PyOverflowError>(value.py()) {
            true => PyValueError::new_err(format!("targets are counted from 0, not {value}")),
            false => error,
        }
    })
}

/// The numbers of a rectangle.
pub fn numbers(rect: &Rect) -> Numbers {
    (rect.x, rect.y, rect.width, rect.height)
}
