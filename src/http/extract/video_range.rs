//! The frames of an uploaded video that are tracked, in their order: from a first one forwards, or backwards.

use super::video_frames::VideoFrames;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_ingest::video::VideoPicture;
use bagtrack_sessions::Charge;
use std::collections::VecDeque;

/// Which frames of a video are tracked.
#[derive(Debug, Clone, Copy)]
pub struct VideoRange {
    /// The number of the first one, counted from 0.
    pub start: u64,
    /// Most frames after the first one.
    pub count: u64,
    /// Whether the frames before `start` follow it, in reverse order down to frame 0.
    pub backwards: bool,
}

impl VideoRange {
    /// How many frames of the video come before all that are wanted.
    pub fn passed_over(&self) -> u64 {
        match self.backwards {
            true => self.start.saturating_sub(self.count),
            false => self.start,
        }
    }
}

/// A frame of a range.
#[derive(Debug)]
pub struct RangeFrame {
    /// Its number in the video, counted from 0.
    pub number: u64,
    /// When it is shown, in seconds after the first frame of the video.
    pub time: f64,
    /// A JPEG file.
    pub file: Bytes,
}

/// The frames of a range, as they are decoded. Frames of a backward range are kept as JPEG files until they are given,
/// and their bytes are charged like uploads.
#[derive(Debug)]
pub struct RangeFrames {
    video: VideoFrames,
    range: VideoRange,
    charge: Charge,
    /// How many frames were decoded.
    decoded: u64,
    /// When the first frame of the video is shown, in the video's own time.
    begin: f64,
    /// How many frames were given.
    given: u64,
    /// Frames that are still to be given, by their numbers; the last one is given next.
    kept: VecDeque<RangeFrame>,
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
            begin: 0.0,
            given: 0,
            kept: VecDeque::new(),
            bytes: 0,
            goes_on: false,
        }
    }

    /// How many frames were given.
    pub fn given(&self) -> u64 {
        self.given
    }

    /// The next frame; none after the last.
    pub async fn next(&mut self) -> Option<Result<RangeFrame, Problem>> {
        if self.given > self.range.count {
            return None;
        }
        if self.given == 0
            && let Err(problem) = self.reach_start().await
        {
            return Some(Err(problem));
        }
        let frame = match (self.kept.pop_back(), self.range.backwards) {
            (Some(frame), _) => {
                self.bytes -= frame.file.len();
                self.charge.shrink(self.bytes);
                Ok(frame)
            }
            (None, true) => return None,
            (None, false) => self
                .decode()
                .await?
                .map_err(|problem| self.with_rest(problem)),
        };
        self.given += u64::from(frame.is_ok());
        Some(frame)
    }

    /// Decodes the next frame of the video; none after the last.
    async fn decode(&mut self) -> Option<Result<RangeFrame, Problem>> {
        let picture = self.video.next().await?;
        Some(picture.map(|VideoPicture { jpeg, time }| {
            let number = self.decoded;
            if number == 0 {
                self.begin = time;
            }
            self.decoded += 1;
            RangeFrame {
                number,
                time: time - self.begin,
                file: jpeg.into(),
            }
        }))
    }

    /// Where a request has too many frames, says how to track the rest in another one.
    fn with_rest(&self, problem: Problem) -> Problem {
        if problem.kind() != Kind::TooManyFrames {
            return problem;
        }
        let last = self.decoded.saturating_sub(1);
        problem.and(&format!("`start={last}` with its last box goes on."))
    }

    /// Decodes up to frame `start`, and keeps it; of a backward range, the wanted frames before it, too.
    async fn reach_start(&mut self) -> Result<(), Problem> {
        let VideoRange {
            start,
            count,
            backwards,
        } = self.range;
        while self.decoded <= start {
            let Some(frame) = self.decode().await else {
                return Err(no_frame(start, self.decoded));
            };
            let frame = frame?;
            let is_wanted = backwards && start - frame.number <= count;
            if is_wanted || frame.number == start {
                self.charge.grow(frame.file.len())?;
                self.bytes += frame.file.len();
                self.kept.push_back(frame);
            }
        }
        if backwards {
            self.goes_on = self.video.next().await.is_some();
            self.video.end();
        }
        Ok(())
    }

    /// Whether the video has a frame after all that were given. May decode that frame and drop it, so call this last.
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
