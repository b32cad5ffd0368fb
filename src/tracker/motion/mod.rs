//! TODO-doc

pub(crate) mod change_test;
pub(crate) mod global_motion;
pub(crate) mod orientation;
pub(crate) mod pair_integral;
pub(crate) mod particles;
pub(crate) mod proposal;
