//! The evaluation: its program, synthetic clips, and the accuracy that is promised.

mod command;
mod model;
mod playback;
mod program;
mod program_more;
mod results;
mod sample_clip;
mod sample_scenes;
mod status;
mod textbook_video;
mod videos;
