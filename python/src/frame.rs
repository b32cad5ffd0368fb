//! NumPy arrays to frames.

use bagtrack_tracker::Frame;
use numpy::ndarray::ArrayViewD;
use numpy::{PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::borrow::Cow;

/// The frame in an array of 8-bit values: height x width (gray), or height x width x 3 (BGR). The pixels are read while
/// the interpreter is locked, so that no other thread can write to them meanwhile.
///
/// # Errors
/// Another object, type of values or shape.
pub fn frame(object: &Bound<'_, PyAny>) -> PyResult<Frame> {
    let array = object.cast::<PyUntypedArray>().map_err(|_| {
        let name = object.get_type().name();
        let name = name.map_or_else(|_| "another object".to_owned(), |it| it.to_string());
        PyTypeError::new_err(format!("a frame is a NumPy array, not {name}"))
    })?;
    let pixels: PyReadonlyArrayDyn<'_, u8> = object.extract().map_err(|_| {
        let dtype = array.dtype();
        PyValueError::new_err(format!("a frame has the dtype uint8, not {dtype}"))
    })?;
    let pixels = pixels.as_array();
    let refuse = || {
        let shape: Vec<String> = array.shape().iter().map(usize::to_string).collect();
        PyValueError::new_err(format!(
            "a frame has the shape (height, width) or (height, width, 3), not ({})",
            shape.join(", ")
        ))
    };
    let side = |length: usize| u32::try_from(length).map_err(|_| refuse());
    let frame = match *array.shape() {
        [height, width] | [height, width, 1] => {
            Frame::from_luma(side(width)?, side(height)?, row_order(&pixels).into_owned())
        }
        [height, width, 3] => Frame::from_bgr(side(width)?, side(height)?, &row_order(&pixels)),
        _ => return Err(refuse()),
    };
    frame.map_err(|error| PyValueError::new_err(error.to_string()))
}

/// The values row by row, copied where the array lies in memory otherwise.
fn row_order<'a>(pixels: &'a ArrayViewD<'_, u8>) -> Cow<'a, [u8]> {
    match pixels.as_slice() {
        Some(values) => Cow::Borrowed(values),
        None => Cow::Owned(pixels.iter().copied().collect()),
    }
}
