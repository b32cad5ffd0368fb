//! The command line, as a person types it.

mod curl_session;
mod cut_video;
mod drawn_video;
mod help;
mod sample_track;
mod serve;
mod track_formats;
mod track_model;
mod track_propagation;
mod track_signals;
mod track_video;

use bagtrack_testing::{command, service::program};
