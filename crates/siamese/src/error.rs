//! What a model can be refused for.

/// Why the bytes of two files are no model that runs here.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A file is no ONNX file, or a damaged one.
    #[error("it is not an ONNX file that can be read: {0}")]
    NotOnnx(&'static str),
    /// The network has an operation that is not known here, or uses one in a way that is not.
    #[error("its operation {kind} cannot be run here: {reason}")]
    Operation {
        /// The name that ONNX gives the operation.
        kind: String,
        /// Why the operation cannot be run.
        reason: &'static str,
    },
    /// The network runs, but it is not that of the tracker that was named.
    #[error("it is not the network that was named: {0}")]
    Unexpected(&'static str),
}
