//! The command line, as a person types it.

mod help;
mod readme_session;
mod sample_track;
mod track_video;

use bagtrack_testing::command;
