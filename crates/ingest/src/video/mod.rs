//! Videos to pictures, by an installed `ffmpeg`.
//!
//! In: the bytes of a video, or a file. Out: its pictures in order, as JPEG files of high quality with their times.
//! They are then decoded as uploaded frames are.
//!
//! A video comes from anywhere, and its decoder is a large program in C. So it runs in a process of its own: it reads
//! one file or pipe and writes another, knows no other protocol, few formats and few codecs, and its memory, processor
//! time, files and priority are limited (on Linux). For a file of the person who runs the program, all formats and
//! codecs are allowed, and memory and processor time are not limited. The process ends when its pictures are no longer
//! wanted.
//!
//! A message of ffmpeg on its standard error is a fault: no further picture is given, since its number in the video
//! would be unknown. Before the first picture, ffmpeg may be started anew: a video that was cut may begin with pictures
//! that need others before the cut.
//!
//! What can go wrong: there is no `ffmpeg`, it cannot decode the video, or that takes more than it may. The error has
//! the first line of ffmpeg's messages, which names the cause.

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
