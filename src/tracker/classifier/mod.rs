//! TODO-doc

pub(crate) mod channel_planes;
pub(crate) mod dense_search;
pub(crate) mod ridge;
pub(crate) mod samples;
pub(crate) mod sliding_window;
