//! All figures of an evaluation, as a table for people and as JSON for programs.

use super::figures::{Figures, Named, ScoreFigures, SeedMean};
use super::playback::Playback;
use super::run::SequenceRuns;
use super::table::{Table, figure};
use bagtrack_tracker::Preset;
use serde::Serialize;
use std::fmt::{self, Write};

const HEADER: [&str; 9] = [
    "sequence",
    "frames",
    "annotated",
    "centre error",
    "sem",
    "precision@20",
    "overlap",
    "auc",
    "ms/frame",
];

/// All figures of an evaluation. As text (`Display`) a table and some lines, as JSON (`Serialize`) the same in full
/// precision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    preset: Preset,
    /// How the sequences were played; none where in the default way.
    #[serde(skip_serializing_if = "Option::is_none")]
    playback: Option<Playback>,
    seeds: usize,
    sequences: Vec<Named>,
    mean: Figures,
    seed_means: Vec<SeedMean>,
    worst_seed: SeedMean,
    score: ScoreFigures,
}

impl Report {
    /// Puts the runs of one or more sequences together; None where there are none.
    pub fn new(preset: Preset, runs: &[SequenceRuns]) -> Option<Self> {
        let sequences: Vec<Named> = runs.iter().map(Named::of).collect();
        let seed_means = SeedMean::all(runs);
        Some(Self {
            preset,
            playback: None,
            seeds: seed_means.len(),
            mean: Figures::over_sequences(&sequences),
            sequences,
            worst_seed: SeedMean::worst(&seed_means)?,
            seed_means,
            score: ScoreFigures::of(runs),
        })
    }

    /// Tells how the sequences were played.
    #[must_use]
    pub fn played(mut self, playback: Playback) -> Self {
        self.playback = playback.unusual();
        self
    }

    /// The means over the sequences.
    pub fn mean(&self) -> &Figures {
        &self.mean
    }

    /// The seed with the largest mean centre error over the sequences.
    pub fn worst_seed(&self) -> &SeedMean {
        &self.worst_seed
    }

    /// How good the score is.
    pub fn score(&self) -> &ScoreFigures {
        &self.score
    }

    fn table(&self) -> Table {
        let mut table = Table::new(&HEADER);
        let rows = self.sequences.iter().map(|s| (s.name.as_str(), &s.figures));
        for (name, figures) in rows.chain([("mean", &self.mean)]) {
            table.push(vec![
                name.to_owned(),
                figures.frames.to_string(),
                figures.annotated.to_string(),
                figure(Some(figures.center_error), 1),
                figure(figures.center_error_sem, 1),
                figure(Some(figures.precision_20), 3),
                figure(Some(figures.overlap), 3),
                figure(Some(figures.success_auc), 3),
                figure(Some(figures.step_ms), 3),
            ]);
        }
        table
    }

    fn lines(&self) -> String {
        let mut text = String::new();
        if let Some(playback) = self.playback {
            let _ = writeln!(text, "{playback}");
        }
        if let Some(error) = self.mean.center_error_sem {
            let count = self.sequences.len();
            let _ = writeln!(
                text,
                "standard error over the {count} sequences: {error:.1} px"
            );
        }
        let seeds: Vec<String> = self
            .seed_means
            .iter()
            .map(|mean| format!("{:.1}", mean.center_error))
            .collect();
        let worst = &self.worst_seed;
        let _ = writeln!(
            text,
            "mean centre error of the seeds 0, 1 ...: {} px; worst {:.1} px (seed {}: overlap {:.3}, precision@20 {:.3})",
            seeds.join(", "),
            worst.center_error,
            worst.seed,
            worst.overlap,
            worst.precision_20,
        );
        let _ = writeln!(
            text,
            "score against overlap >= 0.5, {} frames: area under the ROC curve {}, calibration error {}, leaving one sequence out {}",
            self.score.frames,
            figure(self.score.roc_auc, 3),
            figure(self.score.ece, 3),
            figure(self.score.ece_leave_one_out, 3),
        );
        text
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.table().text(), self.lines())
    }
}
