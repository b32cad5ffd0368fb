//! TODO-doc

pub(crate) mod score;
pub(crate) mod update_gate;
