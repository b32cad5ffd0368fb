//! What a request may look like: its form, its labels, its body; and answers as lines.

pub mod compressed;
pub mod forms;
pub mod labels;
pub mod lines;
pub mod mistakes;
pub mod multer;
pub mod uploads;
