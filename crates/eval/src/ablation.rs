//! The ablation: a table with one row for each extension that is switched off or parameter that is changed.
//!
//! A row whose settings equal those of the evaluated preset is not run again: it repeats the figures of the first row.

use super::variant::Variant;
use bagtrack_cli::parse_assignment;

/// A label, and the parameters that are set for it, as text.
type Row = (&'static str, &'static [(&'static str, &'static str)]);

/// The rows after that of the preset itself.
const ROWS: &[Row] = &[
    ("paper: every extension off", &[("preset", "paper")]),
    ("α = 0: bases alone", &[("alpha", "0")]),
    ("α = 0.5", &[("alpha", "0.5")]),
    ("α = 1: means alone", &[("alpha", "1")]),
    (
        "gray values instead of gradients",
        &[
            ("features", "gray"),
            ("patch_width", "32"),
            ("patch_height", "32"),
        ],
    ),
    ("320 pixels for any target", &[("target_side", "0")]),
    ("no chroma in cells", &[("chroma_weight", "0")]),
    ("no colour histogram", &[("histogram_weight", "0")]),
    (
        "neither, all in gray",
        &[("chroma_weight", "0"), ("histogram_weight", "0")],
    ),
    ("the box alone, no rim", &[("context", "1")]),
    (
        "candidates with their history",
        &[("single_vector_candidate", "false")],
    ),
    ("no background metric", &[("background_samples", "0")]),
    ("resampled particles", &[("search", "resampled")]),
    ("no prior on the displacement", &[("displacement_std", "0")]),
    ("no scale filter", &[("scale_learning_rate", "0")]),
    ("no dense search", &[("dense_maxima", "0")]),
    ("no augmented first image", &[("augmentation_angle", "0")]),
    (
        "the first subspace weighs as any other",
        &[("pinned_weight", "1")],
    ),
    (
        "the first subspace leaves the bag",
        &[("pinned_weight", "0")],
    ),
    ("no change test", &[("static_penalty", "0")]),
    ("no global motion", &[("global_motion", "false")]),
    ("updates at any distance", &[("update_distance_ratio", "0")]),
    ("no discriminant", &[("discriminant_weight", "0")]),
];

/// The variants of the ablation, the first of which is the preset as it is, under the name `base`.
pub fn variants(base: &str) -> Vec<Variant> {
    let unchanged = Variant {
        label: base.to_owned(),
        assignments: Vec::new(),
    };
    let row = |&(label, set): &Row| Variant {
        label: label.to_owned(),
        assignments: set
            .iter()
            .map(|(name, value)| {
                parse_assignment(&format!("{name}={value}")).expect("it is NAME=VALUE")
            })
            .collect(),
    };
    std::iter::once(unchanged)
        .chain(ROWS.iter().map(row))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bagtrack_tracker::Preset;

    #[test]
    fn every_row_sets_parameters_that_there_are_to_values_in_their_ranges() {
        for preset in [Preset::Paper, Preset::Robust] {
            for variant in variants("base") {
                if let Err(error) = variant.params(&preset.params()) {
                    panic!("{}, {preset:?}: {error}", variant.label);
                }
            }
        }
    }

    #[test]
    fn every_label_is_there_once() {
        let mut labels: Vec<String> = variants("base").into_iter().map(|v| v.label).collect();
        let count = labels.len();
        labels.sort();
        labels.dedup();
        assert_eq!(labels.len(), count);
    }
}
