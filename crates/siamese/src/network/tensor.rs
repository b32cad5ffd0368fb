//! Numbers with a shape.

use crate::onnx::model::{Constant, Data};

/// An array of numbers in row order: the last side runs fastest.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tensor {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
}

impl Tensor {
    /// Channels, height and width of one image; none where the shape is another.
    pub fn image(&self) -> Option<(usize, usize, usize)> {
        match self.shape[..] {
            [1, channels, height, width] => Some((channels, height, width)),
            _ => None,
        }
    }
}

/// What a node takes: numbers, or sizes and indices that are known beforehand.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Slot {
    Tensor(Tensor),
    Integers(Vec<i64>),
    /// Not computed yet, or not needed any more.
    Empty,
}

impl Slot {
    pub fn of(constant: Constant) -> Self {
        match constant.data {
            Data::Floats(values) => Self::Tensor(Tensor {
                shape: constant.shape,
                values,
            }),
            Data::Integers(values) => Self::Integers(values),
        }
    }

    pub fn tensor(&self) -> Option<&Tensor> {
        match self {
            Self::Tensor(tensor) => Some(tensor),
            _ => None,
        }
    }

    pub fn integers(&self) -> Option<&[i64]> {
        match self {
            Self::Integers(values) => Some(values),
            _ => None,
        }
    }
}
