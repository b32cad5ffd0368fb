//! The forms, labels and bodies of requests, and answers as lines.

pub mod compressed;
pub mod forms;
pub mod labels;
pub mod lines;
pub mod mistakes;
pub mod multer;
pub mod uploads;
