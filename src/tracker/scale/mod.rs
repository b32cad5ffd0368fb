//! TODO-doc

pub(crate) mod dsst;
pub(crate) mod pyramid;
