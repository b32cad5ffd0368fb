//! Which answers of a track are written: all, those until a target is lost, or the key frames alone.

use bagtrack_tracker::{Estimate, KeyFrames, Status};
use std::mem;

/// How far the box of a frame that is left out may be from the one interpolated between key frames, in pixels.
const TOLERANCE: f64 = 1.0;

/// Picks the rows of each target as they come. A row is whatever goes with an answer: a line of a file, an answer.
#[derive(Debug)]
pub struct Selection<T> {
    /// Whether a target's first lost row is its last one.
    until_lost: bool,
    targets: Vec<Target<T>>,
    /// The number of the frame, from 0.
    frame: u64,
    /// Where only key frames are wanted: rows of the previous frame that are key frames. The next frame tells whether
    /// its other rows are.
    key_rows: Option<Vec<Numbered<T>>>,
}

/// A target's rows that may still be written, and whether it has ended.
#[derive(Debug)]
struct Target<T> {
    key_frames: KeyFrames<Numbered<T>>,
    has_ended: bool,
}

/// A row with its frame and target.
#[derive(Debug)]
struct Numbered<T> {
    frame: u64,
    target: usize,
    row: T,
}

impl<T> Selection<T> {
    /// A selection for `targets` targets. `until_lost`: a target's first lost row is its last one.
    pub fn new(targets: usize, until_lost: bool, only_key_frames: bool) -> Self {
        let target = || Target {
            key_frames: KeyFrames::new(TOLERANCE),
            has_ended: false,
        };
        Self {
            until_lost,
            targets: (0..targets).map(|_| target()).collect(),
            frame: 0,
            key_rows: only_key_frames.then(Vec::new),
        }
    }

    /// Takes the answers to a frame, one for each target, with their rows, and returns rows to write: those of this
    /// frame or, where only key frames are wanted, those of the previous frame, whose key frames are known by now.
    pub fn take(&mut self, answers: impl IntoIterator<Item = (Estimate, T)>) -> Vec<T> {
        let frame = self.frame;
        self.frame += 1;
        let (mut now, mut next) = (Vec::new(), Vec::new());
        let before = self.key_rows.take();
        let only_key_frames = before.is_some();
        let mut before = before.unwrap_or_default();
        for (target, (estimate, row)) in answers.into_iter().enumerate() {
            let known = &mut self.targets[target];
            if known.has_ended {
                continue;
            }
            let is_lost = estimate.status == Status::Lost;
            known.has_ended = self.until_lost && is_lost;
            let row = Numbered { frame, target, row };
            if !only_key_frames {
                now.push(row.row);
                continue;
            }
            for key in known.key_frames.push(estimate.target, !is_lost, row) {
                let rows = if key.frame < frame {
                    &mut before
                } else {
                    &mut next
                };
                rows.push(key);
            }
        }
        if only_key_frames {
            self.key_rows = Some(next);
            now = in_order(before);
        }
        now
    }

    /// Whether no target's rows are wanted any more.
    pub fn has_ended(&self) -> bool {
        self.targets.iter().all(|target| target.has_ended)
    }

    /// The rows that are still to be written at the end of the track. What is taken afterwards begins another track.
    pub fn finish(&mut self) -> Vec<T> {
        let mut rows = self.key_rows.as_mut().map_or_else(Vec::new, mem::take);
        for target in &mut self.targets {
            rows.extend(target.key_frames.finish());
        }
        in_order(rows)
    }
}

fn in_order<T>(mut rows: Vec<Numbered<T>>) -> Vec<T> {
    rows.sort_by_key(|row| (row.frame, row.target));
    rows.into_iter().map(|row| row.row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bagtrack_tracker::Rect;

    /// The rows (frame, target) that are given, call by call, for these positions and statuses of each target.
    fn given(
        selection: &mut Selection<(usize, usize)>,
        track: &[Vec<(f64, Status)>],
    ) -> Vec<Vec<(usize, usize)>> {
        let mut calls = Vec::new();
        for (frame, targets) in track.iter().enumerate() {
            let answers = targets.iter().enumerate().map(|(target, (x, status))| {
                let estimate = Estimate {
                    frame: frame as u64,
                    target: Rect::new(*x, 10.0, 20.0, 30.0),
                    score: 1.0,
                    status: *status,
                };
                (estimate, (frame, target))
            });
            calls.push(selection.take(answers));
            if selection.has_ended() {
                break;
            }
        }
        calls.push(selection.finish());
        calls
    }

    #[test]
    fn a_key_frame_is_given_with_the_next_frame_and_the_rows_are_in_order() {
        // The first target turns at frame 2; the second one stands.
        let turn = [0.0, 5.0, 10.0, 5.0, 0.0]
            .map(|x| vec![(x, Status::Tracking), (3.0, Status::Tracking)]);
        let calls = given(&mut Selection::new(2, false, true), &turn);
        let expected: [&[(usize, usize)]; 6] = [
            &[],
            &[(0, 0), (0, 1)],
            &[],
            &[(2, 0)],
            &[],
            &[(4, 0), (4, 1)],
        ];
        assert_eq!(calls, expected);
    }

    #[test]
    fn a_target_ends_with_the_frame_in_which_it_is_lost_and_the_track_with_the_last_one() {
        use Status::{Lost, Tracking};
        let track = [
            vec![(0.0, Tracking), (0.0, Tracking)],
            vec![(1.0, Lost), (1.0, Tracking)],
            vec![(2.0, Tracking), (2.0, Tracking)],
            vec![(3.0, Tracking), (3.0, Lost)],
            vec![(4.0, Tracking), (4.0, Tracking)],
        ];
        let calls = given(&mut Selection::new(2, true, false), &track);
        let expected: [&[(usize, usize)]; 5] = [
            &[(0, 0), (0, 1)],
            &[(1, 0), (1, 1)],
            &[(2, 1)],
            &[(3, 1)],
            &[],
        ];
        assert_eq!(calls, expected);
        let calls = given(&mut Selection::new(2, true, true), &track);
        let keys: Vec<_> = calls.concat();
        assert_eq!(keys, [(0, 0), (0, 1), (1, 0), (2, 1), (3, 1)]);
    }
}
