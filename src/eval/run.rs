//! Runs: one sequence, several seeds.

use super::measures::{self, PRECISION_RADIUS};
use super::report::{Figures, Named};
use super::sequence::Sequence;
use crate::tracker::{Params, Rect, Tracker, TrackerError};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// A run cannot be done; the text names the sequence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvalError {
    /// The tracker refuses the parameters, the first box, or a frame.
    #[error("{sequence}, frame {frame}: {source}")]
    Tracker {
        /// Name of the sequence.
        sequence: String,
        /// Index of the frame, from 0.
        frame: usize,
        /// What the tracker says.
        source: TrackerError,
    },
    /// There is nothing to measure: the box of the first frame is given, those of others are held against.
    #[error("{0}: the first frame and at least one more must be annotated")]
    NothingToScore(String),
}

/// What one seed gave.
#[derive(Debug, Clone, PartialEq)]
pub struct SeedRun {
    /// The tracked box of every frame; that of the first is the given one.
    pub boxes: Vec<Rect>,
    /// Wall time spent in [`Tracker::step`] alone.
    pub step_time: Duration,
}

impl SeedRun {
    fn track(sequence: &Sequence, params: Params) -> Result<Self, EvalError> {
        let refuse = |frame: usize| {
            move |source| EvalError::Tracker {
                sequence: sequence.name.clone(),
                frame,
                source,
            }
        };
        let first =
            sequence.boxes[0].ok_or_else(|| EvalError::NothingToScore(sequence.name.clone()))?;
        let mut tracker = Tracker::new(&sequence.frames[0], first, params).map_err(refuse(0))?;
        let mut boxes = vec![first];
        let mut step_time = Duration::ZERO;
        for (index, frame) in sequence.frames.iter().enumerate().skip(1) {
            let start = Instant::now();
            let estimate = tracker.step(frame);
            step_time += start.elapsed();
            boxes.push(estimate.map_err(refuse(index))?.target);
        }
        Ok(Self { boxes, step_time })
    }

    /// The figures of this run against the annotated frames after the first, which is given.
    fn figures(&self, sequence: &Sequence) -> Result<Figures, EvalError> {
        let scored: Vec<(&Rect, &Rect)> = self
            .boxes
            .iter()
            .zip(&sequence.boxes)
            .skip(1)
            .filter_map(|(tracked, annotated)| Some((tracked, annotated.as_ref()?)))
            .collect();
        if scored.is_empty() {
            return Err(EvalError::NothingToScore(sequence.name.clone()));
        }
        let errors: Vec<f64> = scored
            .iter()
            .map(|(a, b)| measures::center_error(a, b))
            .collect();
        let overlaps: Vec<f64> = scored
            .iter()
            .map(|(a, b)| measures::overlap(a, b))
            .collect();
        let steps = (self.boxes.len() - 1) as f64;
        Ok(Figures {
            frames: self.boxes.len(),
            annotated: sequence.boxes.iter().flatten().count(),
            center_error: measures::mean(&errors),
            center_error_sem: None,
            precision_20: measures::precision(&errors, PRECISION_RADIUS),
            overlap: measures::mean(&overlaps),
            success_auc: measures::success_auc(&overlaps),
            step_ms: self.step_time.as_secs_f64() * 1000.0 / steps,
        })
    }
}

/// Tracks through a sequence with the seeds 0 to `seeds` − 1, on `jobs` threads, and gives the means over the
/// seeds. Times are honest with one job only: threads share the machine.
///
/// # Errors
/// See [`EvalError`]; of several, that of the lowest seed.
pub fn run(
    sequence: &Sequence,
    params: &Params,
    seeds: NonZeroUsize,
    jobs: NonZeroUsize,
) -> Result<Named, EvalError> {
    let one = |seed: usize| {
        let params = Params {
            seed: seed as u64,
            ..params.clone()
        };
        SeedRun::track(sequence, params)?.figures(sequence)
    };
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.get() {
                return done;
            }
            done.push((seed, one(seed)));
        }
    };
    let mut done: Vec<(usize, Result<Figures, EvalError>)> = if jobs.get() == 1 {
        work()
    } else {
        thread::scope(|scope| {
            let workers: Vec<_> = (0..jobs.get().min(seeds.get()))
                .map(|_| scope.spawn(work))
                .collect();
            workers
                .into_iter()
                .flat_map(|worker| {
                    worker
                        .join()
                        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
                })
                .collect()
        })
    };
    done.sort_by_key(|(seed, _)| *seed);
    let runs = done
        .into_iter()
        .map(|(_, figures)| figures)
        .collect::<Result<Vec<Figures>, EvalError>>()?;
    Ok(Named {
        name: sequence.name.clone(),
        figures: Figures::over_seeds(&runs),
    })
}
