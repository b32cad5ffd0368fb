//! What decoding and tracking measure.

use super::maker::Maker;
use crate::sessions::Estimates;
use crate::tracker::Status;
use metrics::{Counter, Histogram, Label};
use std::time::{Duration, Instant};

/// What decoding and tracking measure. Clones are the same metrics.
#[derive(Clone)]
pub struct TrackingMetrics {
    decode: Histogram,
    step: Histogram,
    tracking: Counter,
    uncertain: Counter,
    lost: Counter,
    losses: Counter,
}

impl TrackingMetrics {
    /// Metrics that stand at zero.
    pub fn new(make: &Maker) -> Self {
        let frames = |status: &'static str| {
            let labels = [Label::from_static_parts("status", status)];
            make.counter(
                "bagtrack_frames_total",
                "Frames answered, by status; once for each target.",
                &labels,
            )
        };
        Self {
            decode: make.seconds("bagtrack_frame_decode_seconds", "Time to decode a frame."),
            step: make.seconds(
                "bagtrack_frame_step_seconds",
                "Processor time to track a target through a frame.",
            ),
            tracking: frames("tracking"),
            uncertain: frames("uncertain"),
            lost: frames("lost"),
            losses: make.counter(
                "bagtrack_targets_lost_total",
                "Times that a target went out of sight.",
                &[],
            ),
        }
    }

    /// Decodes with `work`, and measures it.
    pub fn decoding<T>(&self, work: impl FnOnce() -> T) -> T {
        let started = Instant::now();
        let result = work();
        self.decode.record(started.elapsed().as_secs_f64());
        result
    }

    /// Frames were tracked, with this processor time for each step of a tracker. `before` is the answer to the frame
    /// before them.
    pub fn tracked(&self, before: &Estimates, answers: &[Estimates], steps: &[Duration]) {
        for step in steps {
            self.step.record(step.as_secs_f64());
        }
        let mut last = before;
        for answer in answers {
            for (estimate, before) in answer.as_slice().iter().zip(last.as_slice()) {
                let counter = match estimate.status {
                    Status::Tracking => &self.tracking,
                    Status::Uncertain => &self.uncertain,
                    Status::Lost => &self.lost,
                };
                counter.increment(1);
                if estimate.status == Status::Lost && before.status != Status::Lost {
                    self.losses.increment(1);
                }
            }
            last = answer;
        }
    }
}
