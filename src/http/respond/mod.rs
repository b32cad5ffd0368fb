//! Responses: JSON, newline-delimited JSON and annotated images, and the header fields of frames' answers.
//!
//! What can go wrong: an answer is larger than the memory for answers, or its client stops reading. The memory of an
//! answer is reserved before the work, and kept until the last byte is sent.

pub mod annotated_image;
pub mod answer;
pub mod body;
pub mod ndjson;
pub mod video_answer;
