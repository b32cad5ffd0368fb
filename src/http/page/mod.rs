//! The web page, the interactive documentation and the sample clips: the program needs no files for them.

pub mod docs;
pub mod sample_clips;
mod static_file;
pub mod static_files;
