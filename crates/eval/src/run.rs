//! Runs: one sequence, several seeds.

use super::sequence::Sequence;
use bagtrack_cli::SequenceError;
use bagtrack_tracker::{Evidence, Expert, Params, Rect, Status, Tracker, TrackerError};
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Why a run cannot be done; the text names the sequence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvalError {
    /// The tracker refuses the parameters, the first box, or a frame.
    #[error("{sequence}, frame {frame}: {source}")]
    Tracker {
        /// Name of the sequence.
        sequence: String,
        /// Index of the frame in the order in which they are played, from 0.
        frame: usize,
        /// What the tracker says.
        source: TrackerError,
    },
    /// A frame cannot be decoded.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// The first frame, or every frame after it, has no annotation: there is nothing to start from or to measure.
    #[error("{0}: the first frame that is played and at least one more must be annotated")]
    NothingToScore(String),
}

/// An annotated frame of a run, compared with its annotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredFrame {
    /// Index of the frame in the order in which they are played, from 0; at least 1, for the first is given.
    pub index: usize,
    /// Distance of the centres in pixels of the uploaded frames.
    pub center_error: f64,
    /// Intersection over union, 0 to 1.
    pub overlap: f64,
    /// The tracker's score, 0 to 1.
    pub score: f64,
    /// The tracker's status in this frame.
    pub status: Status,
    /// The predictors from which the score is computed.
    pub evidence: Option<Evidence>,
}

/// The smallest overlap (intersection over union) of a hit.
pub const HIT_OVERLAP: f64 = 0.5;

/// The outcome of one scored frame of one run: what its score claimed, and whether the box was a hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The claimed probability of a hit, 0 to 1: the tracker's score, or a value fitted to it.
    pub score: f64,
    /// Whether the box overlapped the annotated one by at least [`HIT_OVERLAP`].
    pub hit: bool,
}

/// The result of one seed.
#[derive(Debug, Clone, PartialEq)]
pub struct SeedRun {
    /// The annotated frames after the first, in order; at least one.
    pub scored: Vec<ScoredFrame>,
    /// The answer to each frame in 0-based pixels of the uploaded frames; that to the first is the box given.
    pub boxes: Vec<Rect>,
    /// Mean wall time of one [`Tracker::step`] alone, in milliseconds.
    pub step_ms: f64,
}

/// The results of all seeds on one sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceRuns {
    /// Name of the sequence.
    pub name: String,
    /// Number of frames that are played.
    pub frames: usize,
    /// Number of those that are annotated, the first among them.
    pub annotated: usize,
    /// The runs with the seeds 0, 1, 2 …; at least one, all with the same frames.
    pub seeds: Vec<SeedRun>,
}

impl SequenceRuns {
    /// Scores and hits of all frames of all seeds.
    pub fn outcomes(&self) -> Vec<Outcome> {
        let scored = self.seeds.iter().flat_map(|seed| &seed.scored);
        scored
            .map(|frame| Outcome {
                score: frame.score,
                hit: frame.overlap >= HIT_OVERLAP,
            })
            .collect()
    }
}

impl SeedRun {
    fn track(
        sequence: &Sequence,
        seed: usize,
        params: &Params,
        expert: Option<Arc<dyn Expert>>,
    ) -> Result<Self, EvalError> {
        let refuse = |frame: usize| {
            move |source| EvalError::Tracker {
                sequence: sequence.name.clone(),
                frame,
                source,
            }
        };
        let nothing = || EvalError::NothingToScore(sequence.name.clone());
        let first = sequence.first_box(seed).ok_or_else(nothing)?;
        let params = Params {
            seed: seed as u64,
            ..params.clone()
        };
        let frames = sequence.frames(&params, &first)?;
        let tracker = Tracker::beside(&frames[0], first, params, expert);
        let mut tracker = tracker.map_err(refuse(0))?;
        let mut scored = Vec::new();
        let mut boxes = vec![first];
        let mut step_time = Duration::ZERO;
        for (index, frame) in frames.iter().enumerate().skip(1) {
            let start = Instant::now();
            let estimate = tracker.step(frame);
            step_time += start.elapsed();
            let estimate = estimate.map_err(refuse(index))?;
            boxes.push(estimate.target);
            let Some(annotated) = &sequence.boxes[index] else {
                continue;
            };
            scored.push(ScoredFrame {
                index,
                center_error: estimate.target.center_distance(annotated),
                overlap: estimate.target.overlap(annotated),
                score: f64::from(estimate.score),
                status: estimate.status,
                evidence: tracker.evidence(),
            });
        }
        if scored.is_empty() {
            return Err(nothing());
        }
        let steps = (frames.len() - 1) as f64;
        Ok(Self {
            scored,
            boxes,
            step_ms: step_time.as_secs_f64() * 1000.0 / steps,
        })
    }
}

/// Tracks through a sequence with the seeds 0 to `seeds` − 1, on `jobs` threads. Times are reliable with
/// one job only, because parallel jobs compete for the processor. `expert` gives a second opinion, where there is one.
///
/// # Errors
/// See [`EvalError`]; of several errors, that of the lowest seed.
pub fn run(
    sequence: &Sequence,
    params: &Params,
    expert: Option<&Arc<dyn Expert>>,
    seeds: NonZeroUsize,
    jobs: NonZeroUsize,
) -> Result<SequenceRuns, EvalError> {
    let one = |seed: usize| SeedRun::track(sequence, seed, params, expert.cloned());
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
    let mut done: Vec<(usize, Result<SeedRun, EvalError>)> = if jobs.get() == 1 {
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
    let seeds = done
        .into_iter()
        .map(|(_, run)| run)
        .collect::<Result<Vec<SeedRun>, EvalError>>()?;
    Ok(SequenceRuns {
        name: sequence.name.clone(),
        frames: sequence.boxes.len(),
        annotated: sequence.boxes.iter().flatten().count(),
        seeds,
    })
}
