//! The pictures of a video from one of them back to its first.

use super::video_info::{FFMPEG, VideoInfo};
use bagtrack_ingest::video::{VideoDecoder, VideoLimits};
use std::error::Error;
use std::path::PathBuf;

/// Pictures that are decoded forwards in one run, and kept as JPEG files to be returned backwards.
const RUN: u64 = 64;

/// A video that is read backwards, run by run.
pub struct Reversed {
    path: PathBuf,
    limits: VideoLimits,
    /// The pictures before this one are not decoded yet.
    end: u64,
    /// The decoded pictures from `end` on that are still to be returned, the last one first.
    run: Vec<Vec<u8>>,
}

impl Reversed {
    /// The pictures from number `first` back to number 0.
    pub fn new(path: PathBuf, limits: VideoLimits, first: u64) -> Self {
        Self {
            path,
            limits,
            end: first + 1,
            run: Vec::new(),
        }
    }

    /// The picture before the one that was returned last; `None` after number 0, or where the video has too few
    /// pictures.
    pub fn next_picture(&mut self, info: &VideoInfo) -> Result<Option<Vec<u8>>, Box<dyn Error>> {
        if self.run.is_empty() && self.end > 0 {
            self.decode_run(info)?;
        }
        Ok(self.run.pop())
    }

    /// Decodes the run before `end`. A file without an index is decoded from its beginning.
    fn decode_run(&mut self, info: &VideoInfo) -> Result<(), Box<dyn Error>> {
        let begin = self.end.saturating_sub(RUN);
        let (first, from) = info.seek_to(begin).unzip();
        let passed_over = begin - first.unwrap_or(0);
        let decoder = VideoDecoder::of_file(FFMPEG, &self.path, from, self.limits)
            .map_err(|error| format!("{error}; install ffmpeg"))?;
        self.run = pictures(decoder, passed_over, self.end - begin)?;
        self.end = begin;
        Ok(())
    }
}

/// The `count` pictures after the first `passed_over`; empty where there are fewer.
fn pictures(
    mut decoder: VideoDecoder,
    passed_over: u64,
    count: u64,
) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let mut found = Vec::new();
    for index in 0..passed_over + count {
        let Some(picture) = decoder.next_picture()? else {
            return Ok(Vec::new());
        };
        if index >= passed_over {
            found.push(picture.jpeg);
        }
    }
    Ok(found)
}
