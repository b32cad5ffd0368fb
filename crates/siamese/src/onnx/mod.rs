//! ONNX files, as far as a network of this crate needs them.
//!
//! - `protobuf`: the fields of a message.
//! - `model`: the graph in a file: nodes with their attributes, constants, names of inputs and outputs.
//!
//! In: the bytes of a file. Out: a [`Graph`](model::Graph), nothing of which is checked beyond its form. What can go
//! wrong: bytes that are no ONNX file, and data of a type that is not read ([`ModelError`](crate::ModelError)).

pub(crate) mod model;
pub(crate) mod protobuf;
