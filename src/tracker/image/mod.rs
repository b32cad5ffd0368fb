//! TODO-doc

pub(crate) mod area_average;
pub(crate) mod downsample;
pub(crate) mod frame;
pub(crate) mod frame_views;
pub(crate) mod rect;
pub(crate) mod thumbnail;
pub(crate) mod warp;
