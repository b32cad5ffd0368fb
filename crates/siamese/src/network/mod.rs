//! Networks that run: convolutional ones with some million multiplications, on one thread.
//!
//! - `tensor`: numbers with a shape.
//! - `operation`: one node of a graph, its attributes read.
//! - `plan`: a graph in the order in which it runs.
//! - `convolution`, `elementwise`, `product`: what the operations compute.
//! - `memory`: buffers that are used again.
//!
//! In: a [`Graph`](crate::onnx::model::Graph) once, and tensors in each run. Out: tensors. What can go wrong, at the
//! start or in a run: an operation that is not known, and shapes that do not fit ([`ModelError`](crate::ModelError)).
//! Shapes are those of one image: the first side of a tensor is 1.

mod convolution;
mod elementwise;
pub(crate) mod memory;
mod operation;
pub(crate) mod plan;
mod product;
pub(crate) mod tensor;
