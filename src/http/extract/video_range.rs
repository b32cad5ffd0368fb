//! The frames of an uploaded video that are tracked, in their order: from one of them on, or back from it.

use super::video_frames::VideoFrames;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use bagtrack_sessions::Charge;
use std::collections::VecDeque;

/// Which frames of a video.
#[derive(Debug, Clone, Copy)]
pub struct VideoRange {
    /// The first one, counted from 0.
    pub start: u64,
    /// At most so many after it.
    pub count: u64,
    /// Whether those before `start` come after it, back to frame 0.
    pub backwards: bool,
}

/// The frames of a range, as they are decoded. Those that are taken backwards are kept as JPEG files, and their bytes are
/// charged as those of uploads.
#[derive(Debug)]
pub struct RangeFrames {
    video: VideoFrames,
    range: VideoRange,
    charge: Charge,
    /// How many frames were decoded.
    decoded: u64,
    /// How many frames were given.
    given: u64,
    /// Those that are still to be given backwards; the next one is the last.
    kept: VecDeque<Bytes>,
    bytes: usize,
    /// Whether there is a frame after `start`, where the frames go backwards from there.
    goes_on: bool,
}

impl RangeFrames {
    /// The frames of `range` in a video. What is kept of them is charged to `charge`.
    pub fn new(video: VideoFrames, range: VideoRange, charge: Charge) -> Self {
        Self {
            video,
            range,
            charge,
            decoded: 0,
            given: 0,
            kept: VecDeque::new(),
            bytes: 0,
            goes_on: false,
        }
    }

    /// The next frame with its number in the video; none after the last.
    pub async fn next(&mut self) -> Option<Result<(u64, Bytes), Problem>> {
        if self.given > self.range.count {
            return None;
        }
        let number = match self.range.backwards {
            true => self.range.start.checked_sub(self.given)?,
            false => self.range.start + self.given,
        };
        if self.given == 0
            && let Err(problem) = self.reach_start().await
        {
            return Some(Err(problem));
        }
        let file = match self.kept.pop_back() {
            Some(file) => {
                self.bytes -= file.len();
                self.charge.shrink(self.bytes);
                Ok(file)
            }
            None => self.video.next().await?,
        };
        self.given += 1;
        Some(file.map(|file| (number, file)))
    }

    /// Decodes up to the first frame. It is kept, and backwards those before it that are wanted.
    async fn reach_start(&mut self) -> Result<(), Problem> {
        let VideoRange {
            start,
            count,
            backwards,
        } = self.range;
        while self.decoded <= start {
            let Some(file) = self.video.next().await else {
                return Err(no_frame(start, self.decoded));
            };
            let file = file?;
            self.decoded += 1;
            let is_wanted = backwards && start - (self.decoded - 1) <= count;
            if is_wanted || self.decoded > start {
                self.charge.grow(file.len())?;
                self.bytes += file.len();
                self.kept.push_back(file);
            }
        }
        if backwards {
            self.goes_on = self.video.next().await.is_some();
            self.video.end();
        }
        Ok(())
    }

    /// Whether the video has a frame after all that were given. No other one is given afterwards.
    pub async fn go_on(&mut self) -> bool {
        match self.range.backwards {
            true => self.goes_on,
            false => self.video.next().await.is_some(),
        }
    }
}

fn no_frame(start: u64, count: u64) -> Problem {
    let detail = format!("The video has no frame {start}: it has {count}, and the first one is 0.");
    Problem::malformed(detail)
}
