//! Videos to pictures, by an installed `ffmpeg`.
//!
//! In: the bytes of a video, or a file. Out: its pictures in order, as JPEG files of high quality with their times,
//! which then go the way of uploaded frames.
//!
//! A video comes from anywhere, and its decoder is a large program in C. So it runs in a process of its own: it reads
//! one file or pipe and writes another, knows no other protocol, few formats and few codecs, and its memory, processor
//! time, files and priority are limited (on Linux). For a file of the person who runs this, all formats and codecs are
//! known, and memory and processor time are not limited. It ends when its pictures are no longer wanted.
//!
//! What it says is a fault: from the next picture on nothing is given, since nobody knows which picture of the video
//! that would be. Before the first picture it may be begun anew, since a video that was cut may begin with pictures
//! that need others before the cut.
//!
//! What can go wrong: there is no `ffmpeg`, it cannot decode the video, or that takes more than it may. Of what it says
//! the first line is told, which names the cause.

mod child;
mod decoder;
mod error;
mod output;
mod said;
mod sniff;

pub use child::Launcher;
#[cfg(fuzzing)]
pub use decoder::read_output;
pub use decoder::{Stop, VideoDecoder, VideoLimits};
pub use error::{Cost, MAX_MEMORY as MAX_DECODER_MEMORY, VideoError};
pub use output::VideoPicture;
pub use sniff::{VideoFormat, video_format};
