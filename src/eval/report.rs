//! The figures, as a table for people and as JSON for programs.

use super::measures::{mean, standard_error};
use crate::tracker::Preset;
use serde::Serialize;
use std::fmt;

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
    /// The means over the runs of one sequence.
    pub(super) fn over_seeds(runs: &[Figures]) -> Figures {
        Figures {
            frames: runs[0].frames,
            annotated: runs[0].annotated,
            ..Self::means(runs)
        }
    }

    /// The means over sequences, each with the same weight however long it is.
    fn over_sequences(sequences: &[Figures]) -> Figures {
        Figures {
            frames: sequences.iter().map(|s| s.frames).sum(),
            annotated: sequences.iter().map(|s| s.annotated).sum(),
            ..Self::means(sequences)
        }
    }

    fn means(of: &[Figures]) -> Figures {
        let all = |field: fn(&Figures) -> f64| of.iter().map(field).collect::<Vec<f64>>();
        let center_errors = all(|f| f.center_error);
        Figures {
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

/// All figures of an evaluation. As text (`Display`) a table, as JSON (`Serialize`) the same in full precision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    preset: Preset,
    seeds: usize,
    sequences: Vec<Named>,
    mean: Figures,
}

impl Report {
    /// Puts the figures of one or more sequences together; none where there are none.
    pub fn new(preset: Preset, seeds: usize, sequences: Vec<Named>) -> Option<Self> {
        if sequences.is_empty() {
            return None;
        }
        let figures: Vec<Figures> = sequences.iter().map(|s| s.figures.clone()).collect();
        Some(Self {
            preset,
            seeds,
            mean: Figures::over_sequences(&figures),
            sequences,
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = self.sequences.iter().map(|s| (s.name.as_str(), &s.figures));
        let width = rows
            .clone()
            .map(|(name, _)| name.chars().count())
            .max()
            .unwrap_or(0)
            .max(8);
        writeln!(
            f,
            "{:width$}  frames  annotated  centre error    sem  precision@20  overlap    auc  ms/frame",
            "sequence"
        )?;
        for (name, figures) in rows.chain([("mean", &self.mean)]) {
            let sem = figures
                .center_error_sem
                .map_or("-".to_owned(), |sem| format!("{sem:.1}"));
            writeln!(
                f,
                "{name:width$}  {:>6}  {:>9}  {:>12.1}  {sem:>5}  {:>12.3}  {:>7.3}  {:>5.3}  {:>8.3}",
                figures.frames,
                figures.annotated,
                figures.center_error,
                figures.precision_20,
                figures.overlap,
                figures.success_auc,
                figures.step_ms,
            )?;
        }
        Ok(())
    }
}
