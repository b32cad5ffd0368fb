//! The web page, the interactive documentation and the sample clips, all out of the binary.

pub mod docs;
pub mod sample_clips;
mod static_file;
pub mod static_files;
