//! TODO-doc

pub(crate) mod acos;
pub(crate) mod exp;
pub(crate) mod gemm;
pub(crate) mod jacobi;
pub(crate) mod reduce;
pub(crate) mod scratch;
pub(crate) mod vector_ops;
