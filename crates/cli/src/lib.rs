//! What the programs `bagtrack` and `bagtrack-eval` have in common on the command line.
//!
//! [`ParamFlags`] choose the tracker's parameters (`--preset`, `--set NAME=VALUE`), [`ModelFlag`] the network of a
//! second opinion (`--model`), and [`output`] writes new folders and standard output, and draws bars on standard error.
//! [`frames`] lists the frames of a folder, and [`read_boxes`] reads its annotations in the OTB layout.

mod assignment;
mod boxes;
pub mod frames;
mod model;
pub mod output;
mod params;

pub use assignment::{AssignError, Assignment, assign, parse_assignment};
pub use boxes::{BOXES, parse_boxes, read_boxes};
pub use frames::SequenceError;
pub use model::{ModelFiles, ModelFlag};
pub use params::ParamFlags;
