//! Which rows are written: all, those up to where a target is lost, or the key frames.

use crate::cli::formats::Row;
use bagtrack_tracker::{KeyFrames, Status};

/// How far a box that is left out may be from the line between two key frames, in pixels.
const TOLERANCE: f64 = 1.0;

/// Picks rows of each target as they come.
pub struct Selection {
    /// Whether a target's first lost row is its last one.
    until_lost: bool,
    targets: Vec<Target>,
    /// The key frames, if only they are written. They are known late, so they are kept to the end to be in order.
    key_rows: Option<Vec<Row>>,
}

/// What is known of a target.
struct Target {
    key_frames: KeyFrames<Row>,
    has_ended: bool,
}

impl Selection {
    /// For so many targets.
    pub fn new(targets: usize, until_lost: bool, only_key_frames: bool) -> Self {
        let target = || Target {
            key_frames: KeyFrames::new(TOLERANCE),
            has_ended: false,
        };
        Self {
            until_lost,
            targets: (0..targets).map(|_| target()).collect(),
            key_rows: only_key_frames.then(Vec::new),
        }
    }

    /// Takes the rows of a frame, one a target, and gives those to be written now.
    pub fn take(&mut self, rows: Vec<Row>) -> Vec<Row> {
        let mut now = Vec::new();
        for (row, target) in rows.into_iter().zip(&mut self.targets) {
            if target.has_ended {
                continue;
            }
            let is_lost = row.estimate.status == Status::Lost;
            target.has_ended = self.until_lost && is_lost;
            match &mut self.key_rows {
                Some(kept) => {
                    kept.extend(target.key_frames.push(row.estimate.target, !is_lost, row));
                }
                None => now.push(row),
            }
        }
        now
    }

    /// Whether no row is wanted any more.
    pub fn has_ended(&self) -> bool {
        self.targets.iter().all(|target| target.has_ended)
    }

    /// The rows that were kept, in the order in which the frames were taken.
    pub fn finish(mut self) -> Vec<Row> {
        let mut rows = self.key_rows.unwrap_or_default();
        for target in &mut self.targets {
            rows.extend(target.key_frames.finish());
        }
        rows.sort_by_key(|row| (row.estimate.frame, row.target));
        rows
    }
}
