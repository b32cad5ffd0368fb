//! TODO-doc

pub(crate) mod likelihood;
pub(crate) mod posterior;
