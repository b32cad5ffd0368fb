//! TODO-doc

pub(crate) mod block_norm;
pub(crate) mod centering;
pub(crate) mod extractor;
pub(crate) mod gradient;
pub(crate) mod gray;
#[cfg(target_arch = "x86_64")]
pub(crate) mod gray_avx512;
pub(crate) mod hog;
pub(crate) mod hog_cells;
pub(crate) mod integral;
pub(crate) mod quantized;
pub(crate) mod sample_coords;
