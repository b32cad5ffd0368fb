//! Several variants on the same sequences, a row each.

use super::figures::{ScoreFigures, SeedMean};
use super::playback::Playback;
use super::report::Report;
use super::table::{Table, figure};
use super::variant::Variant;
use bagtrack_cli::Assignment;
use bagtrack_tracker::Preset;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::fmt;

const HEADER: [&str; 8] = [
    "variant",
    "centre error",
    "sem",
    "precision@20",
    "overlap",
    "auc",
    "worst seed",
    "ms/frame",
];

/// A variant's figures: means over the sequences.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Row {
    label: String,
    /// The parameters that the variant sets.
    #[serde(serialize_with = "map")]
    set: Vec<Assignment>,
    center_error: f64,
    center_error_sem: Option<f64>,
    precision_20: f64,
    overlap: f64,
    success_auc: f64,
    worst_seed: SeedMean,
    score: ScoreFigures,
    step_ms: f64,
}

fn map<S: Serializer>(set: &[Assignment], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(set.len()))?;
    for (name, value) in set {
        map.serialize_entry(name, value)?;
    }
    map.end()
}

/// The figures of several variants side by side. As text (`Display`) a table, as JSON (`Serialize`) the same in full
/// precision, and what each sets and how good its score is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    preset: Preset,
    /// How the sequences were played; none where in the default way.
    #[serde(skip_serializing_if = "Option::is_none")]
    playback: Option<Playback>,
    seeds: usize,
    sequences: Vec<String>,
    variants: Vec<Row>,
}

impl Comparison {
    /// Puts the reports of variants of `preset` on the same sequences with the same seeds together.
    pub fn new(
        preset: Preset,
        seeds: usize,
        sequences: Vec<String>,
        variants: &[(Variant, Report)],
    ) -> Self {
        let row = |(variant, report): &(Variant, Report)| {
            let mean = report.mean();
            Row {
                label: variant.label.clone(),
                set: variant.assignments.clone(),
                center_error: mean.center_error,
                center_error_sem: mean.center_error_sem,
                precision_20: mean.precision_20,
                overlap: mean.overlap,
                success_auc: mean.success_auc,
                worst_seed: *report.worst_seed(),
                score: *report.score(),
                step_ms: mean.step_ms,
            }
        };
        Self {
            preset,
            playback: None,
            seeds,
            sequences,
            variants: variants.iter().map(row).collect(),
        }
    }

    /// Tells how the sequences were played.
    #[must_use]
    pub fn played(mut self, playback: Playback) -> Self {
        self.playback = playback.unusual();
        self
    }

    fn table(&self) -> Table {
        let mut table = Table::new(&HEADER);
        for row in &self.variants {
            table.push(vec![
                row.label.clone(),
                figure(Some(row.center_error), 1),
                figure(row.center_error_sem, 1),
                figure(Some(row.precision_20), 3),
                figure(Some(row.overlap), 3),
                figure(Some(row.success_auc), 3),
                figure(Some(row.worst_seed.center_error), 1),
                figure(Some(row.step_ms), 3),
            ]);
        }
        table
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.table().text())?;
        match self.playback {
            Some(playback) => writeln!(f, "\n{playback}"),
            None => Ok(()),
        }
    }
}
