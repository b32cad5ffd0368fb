//! Siamese tracking networks as experts beside the tracker: [`NanoTrack`].
//!
//! The user gives the network as ONNX files; no weights are part of this crate. A file may hold only the operations of
//! small convolutional networks over one image (`network`). The networks run on one thread, on any machine.
//!
//! | module | holds |
//! |---|---|
//! | `onnx` | the graph in a file |
//! | `network` | a graph that runs |
//! | `nanotrack` | a picture cut out of a frame, the network's answer, and what is made of it |

mod error;
mod nanotrack;
mod network;
mod onnx;

pub use error::ModelError;
pub use nanotrack::tracker::NanoTrack;
