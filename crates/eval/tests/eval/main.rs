//! Tests of the evaluation: its program, the synthetic clips, and the promised accuracy.

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
