//! The figures of a sequence, of a seed, of everything.

use super::calibration;
use super::measures::{self, PRECISION_RADIUS, mean, standard_error};
use super::run::{SeedRun, SequenceRuns};
use serde::Serialize;

/// The figures of a sequence (means over the seeds), or of all sequences (their mean).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// Number of frames; in the mean over sequences, of all together.
    pub frames: usize,
    /// Number of annotated frames, the first, which is given and not scored, among them; in the mean, of all together.
    pub annotated: usize,
    /// Mean distance of the centres in pixels of the uploaded frames.
    pub center_error: f64,
    /// Standard error of `center_error`: over the seeds' means for a sequence, over the sequences' means in the mean
    /// over sequences (the bars of the paper's plots). None (JSON null) for fewer than two.
    pub center_error_sem: Option<f64>,
    /// Share of scored frames whose centre is at most 20 pixels off, 0 to 1.
    pub precision_20: f64,
    /// Mean intersection over union, 0 to 1.
    pub overlap: f64,
    /// Area under the success plot, 0 to 1.
    pub success_auc: f64,
    /// Mean wall time of one `Tracker::step` alone (no decoding) on its one thread, in milliseconds.
    pub step_ms: f64,
}

impl Figures {
    /// The figures of one run; its counts of frames are 0.
    fn of_run(run: &SeedRun) -> Self {
        let errors: Vec<f64> = run.scored.iter().map(|frame| frame.center_error).collect();
        let overlaps: Vec<f64> = run.scored.iter().map(|frame| frame.overlap).collect();
        Self {
            frames: 0,
            annotated: 0,
            center_error: mean(&errors),
            center_error_sem: None,
            precision_20: measures::precision(&errors, PRECISION_RADIUS),
            overlap: mean(&overlaps),
            success_auc: measures::success_auc(&overlaps),
            step_ms: run.step_ms,
        }
    }

    fn over_seeds(sequence: &SequenceRuns) -> Self {
        let runs: Vec<Self> = sequence.seeds.iter().map(Self::of_run).collect();
        Self {
            frames: sequence.frames,
            annotated: sequence.annotated,
            ..Self::means(&runs)
        }
    }

    /// The means over sequences, each with the same weight however long it is.
    pub(super) fn over_sequences(sequences: &[Named]) -> Self {
        let figures: Vec<Self> = sequences.iter().map(|s| s.figures.clone()).collect();
        Self {
            frames: figures.iter().map(|f| f.frames).sum(),
            annotated: figures.iter().map(|f| f.annotated).sum(),
            ..Self::means(&figures)
        }
    }

    fn means(of: &[Self]) -> Self {
        let all = |field: fn(&Self) -> f64| of.iter().map(field).collect::<Vec<f64>>();
        let center_errors = all(|f| f.center_error);
        Self {
            frames: 0,
            annotated: 0,
            center_error: mean(&center_errors),
            center_error_sem: standard_error(&center_errors),
            precision_20: mean(&all(|f| f.precision_20)),
            overlap: mean(&all(|f| f.overlap)),
            success_auc: mean(&all(|f| f.success_auc)),
            step_ms: mean(&all(|f| f.step_ms)),
        }
    }
}

/// A sequence's figures under its name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Named {
    /// Name of the sequence.
    pub name: String,
    /// Its figures.
    #[serde(flatten)]
    pub figures: Figures,
}

impl Named {
    pub(super) fn of(sequence: &SequenceRuns) -> Self {
        Self {
            name: sequence.name.clone(),
            figures: Figures::over_seeds(sequence),
        }
    }
}

/// The means of one seed over the sequences, each with the same weight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SeedMean {
    /// The seed.
    pub seed: usize,
    /// Mean centre error in pixels.
    pub center_error: f64,
    /// Mean overlap, 0 to 1.
    pub overlap: f64,
    /// Mean precision at 20 pixels, 0 to 1.
    pub precision_20: f64,
}

impl SeedMean {
    /// The means of each seed; all sequences have the same seeds.
    pub(super) fn all(sequences: &[SequenceRuns]) -> Vec<Self> {
        let seeds = sequences.iter().map(|s| s.seeds.len()).min().unwrap_or(0);
        let of_seed = |seed: usize| {
            let runs = sequences.iter().map(|s| Figures::of_run(&s.seeds[seed]));
            let figures = Figures::means(&runs.collect::<Vec<Figures>>());
            Self {
                seed,
                center_error: figures.center_error,
                overlap: figures.overlap,
                precision_20: figures.precision_20,
            }
        };
        (0..seeds).map(of_seed).collect()
    }

    /// The seed's means with the largest centre error; None where there are none.
    pub(super) fn worst(means: &[Self]) -> Option<Self> {
        means
            .iter()
            .copied()
            .max_by(|a, b| a.center_error.total_cmp(&b.center_error))
    }
}

/// How good the tracker's score is; see [`calibration`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScoreFigures {
    /// Area under the ROC curve of the score against an overlap of at least 0.5, 0 to 1. None (JSON null) without
    /// both hits and misses.
    pub roc_auc: Option<f64>,
    /// Expected calibration error of the score in ten bins, 0 to 1.
    pub ece: Option<f64>,
    /// Expected calibration error of chances learnt from the other sequences, 0 to 1. None (JSON null) with one
    /// sequence.
    pub ece_leave_one_out: Option<f64>,
    /// Number of scored frames of all sequences and seeds, over which the figures are taken.
    pub frames: usize,
}

impl ScoreFigures {
    pub(super) fn of(sequences: &[SequenceRuns]) -> Self {
        let by_sequence: Vec<_> = sequences.iter().map(SequenceRuns::outcomes).collect();
        let pooled = by_sequence.concat();
        Self {
            roc_auc: calibration::roc_auc(&pooled),
            ece: calibration::calibration_error(&pooled),
            ece_leave_one_out: calibration::calibration_error_leave_one_out(&by_sequence),
            frames: pooled.len(),
        }
    }
}
