//! One node of a graph, its attributes read.

use crate::error::ModelError;
use crate::onnx::model::{Attribute, Node};

/// What a node computes, as ONNX defines it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Operation {
    Conv(Convolution),
    /// max(0, min(1, alpha · x + beta)).
    HardSigmoid {
        alpha: f32,
        beta: f32,
    },
    HardSwish,
    Relu,
    Sigmoid,
    Exp,
    Clip,
    GlobalAveragePool,
    Gemm {
        transposed: bool,
    },
    MatMul,
    Add,
    Mul,
    Reshape,
    Transpose(Vec<usize>),
    Slice,
    Concat {
        axis: usize,
    },
}

/// How a convolution moves over its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Convolution {
    pub groups: usize,
    pub stride: usize,
    /// Zeros above, left, below and right.
    pub pads: [usize; 4],
}

/// Attributes by name, with what ONNX takes where they are left out.
struct Attributes<'a>(&'a Node);

impl Attributes<'_> {
    fn refuse<T>(&self, reason: &'static str) -> Result<T, ModelError> {
        Err(ModelError::Operation {
            kind: self.0.kind.clone(),
            reason,
        })
    }

    fn float(&self, name: &str, otherwise: f32) -> f32 {
        match self.0.attributes.get(name) {
            Some(Attribute::Float(value)) => *value,
            _ => otherwise,
        }
    }

    fn integer(&self, name: &str, otherwise: i64) -> i64 {
        match self.0.attributes.get(name) {
            Some(Attribute::Integer(value)) => *value,
            _ => otherwise,
        }
    }

    /// A list of sizes or indices, none of them negative.
    fn sizes(&self, name: &str, otherwise: &[usize]) -> Result<Vec<usize>, ModelError> {
        let Some(Attribute::Integers(values)) = self.0.attributes.get(name) else {
            return Ok(otherwise.to_vec());
        };
        let sizes = values.iter().map(|&value| usize::try_from(value));
        let sizes = sizes.collect::<Result<_, _>>();
        sizes.or_else(|_| self.refuse("a size is negative"))
    }

    fn convolution(&self) -> Result<Convolution, ModelError> {
        let strides = self.sizes("strides", &[1, 1])?;
        let dilations = self.sizes("dilations", &[1, 1])?;
        let pads = self.sizes("pads", &[0, 0, 0, 0])?;
        let groups = usize::try_from(self.integer("group", 1)).unwrap_or(0);
        let automatic = match self.0.attributes.get("auto_pad") {
            Some(Attribute::Text(text)) => text != "NOTSET",
            _ => false,
        };
        if dilations.iter().any(|&dilation| dilation != 1) || automatic {
            return self.refuse("it is dilated, or padded automatically");
        }
        match (&strides[..], &pads[..]) {
            (&[stride, across], &[top, left, bottom, right])
                if stride == across && stride > 0 && groups > 0 =>
            {
                Ok(Convolution {
                    groups,
                    stride,
                    pads: [top, left, bottom, right],
                })
            }
            _ => self.refuse("it is not one over two dimensions with one stride"),
        }
    }

    fn gemm(&self) -> Result<Operation, ModelError> {
        let is_plain = self.float("alpha", 1.0) == 1.0
            && self.float("beta", 1.0) == 1.0
            && self.integer("transA", 0) == 0;
        if is_plain {
            let transposed = self.integer("transB", 0) != 0;
            Ok(Operation::Gemm { transposed })
        } else {
            self.refuse("it has factors, or a transposed first matrix")
        }
    }
}

impl Operation {
    /// What `node` computes.
    pub fn of(node: &Node) -> Result<Self, ModelError> {
        let attributes = Attributes(node);
        Ok(match node.kind.as_str() {
            "Conv" => Self::Conv(attributes.convolution()?),
            "HardSigmoid" => Self::HardSigmoid {
                alpha: attributes.float("alpha", 0.2),
                beta: attributes.float("beta", 0.5),
            },
            "HardSwish" => Self::HardSwish,
            "Relu" => Self::Relu,
            "Sigmoid" => Self::Sigmoid,
            "Exp" => Self::Exp,
            "Clip" => Self::Clip,
            "GlobalAveragePool" => Self::GlobalAveragePool,
            "Gemm" => attributes.gemm()?,
            "MatMul" => Self::MatMul,
            "Add" => Self::Add,
            "Mul" => Self::Mul,
            "Reshape" => Self::Reshape,
            "Transpose" => Self::Transpose(attributes.sizes("perm", &[])?),
            "Slice" => Self::Slice,
            "Concat" => match usize::try_from(attributes.integer("axis", -1)) {
                Ok(axis) => Self::Concat { axis },
                Err(_) => return attributes.refuse("its axis is counted from the end"),
            },
            _ => return attributes.refuse("it is not one of those that are known"),
        })
    }
}
