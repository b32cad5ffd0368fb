//! TODO-doc

pub(crate) mod presets;
pub(crate) mod table;
pub(crate) mod validate;
