//! What decoding and tracking measure.

use crate::Estimates;
use crate::clock;
use bagtrack_tracker::Status;
use metrics::{Counter, Histogram};
use std::time::Duration;

/// What decoding and tracking measure. Clones are the same metrics.
#[derive(Debug, Clone)]
pub struct TrackingMetrics {
    /// Seconds to decode a frame.
    pub decode: Histogram,
    /// Seconds of processor time to track a target through a frame.
    pub step: Histogram,
    /// Answers of targets that are tracked.
    pub tracking: Counter,
    /// Answers that are uncertain.
    pub uncertain: Counter,
    /// Answers of targets that are out of sight.
    pub lost: Counter,
    /// Times that a target went out of sight.
    pub losses: Counter,
}

impl TrackingMetrics {
    /// Metrics that nobody collects.
    pub fn noop() -> Self {
        Self {
            decode: Histogram::noop(),
            step: Histogram::noop(),
            tracking: Counter::noop(),
            uncertain: Counter::noop(),
            lost: Counter::noop(),
            losses: Counter::noop(),
        }
    }

    /// Decodes with `work`, and measures it.
    pub fn decoding<T>(&self, work: impl FnOnce() -> T) -> T {
        let started = clock::now();
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
