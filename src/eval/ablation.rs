//! The ablation as data: what the tracker is without each of its mends, one row each.
//!
//! A row that sets nothing that the evaluated preset has not set already is not run again: it has the figures of the
//! first row.

use super::variant::{Variant, parse_assignment};

/// A label, and the parameters that are set for it, as text.
type Row = (&'static str, &'static [(&'static str, &'static str)]);

/// The rows after that of the preset itself.
const ROWS: &[Row] = &[
    ("paper: every mend off", &[("preset", "paper")]),
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
    ("no gray values beside gradients", &[("gray_weight", "0")]),
    ("the box alone, no rim", &[("context", "1")]),
    ("vectors of any length", &[("unit_length", "false")]),
    (
        "candidates with their history",
        &[("single_vector_candidate", "false")],
    ),
    ("no background metric", &[("background_samples", "0")]),
    ("resampled particles", &[("search", "resampled")]),
    ("one stage", &[("refined_share", "0")]),
    ("no prior on the displacement", &[("displacement_std", "0")]),
    (
        "no prior on the change of scale",
        &[("scale_change_std", "0")],
    ),
    ("no prior on the scale", &[("scale_std", "0")]),
    ("no filter for the scale", &[("scale_learning_rate", "0")]),
    ("no look at every place", &[("dense_maxima", "0")]),
    ("no place left out", &[("prune_margin", "0")]),
    ("no poses of the first look", &[("augmentation_angle", "0")]),
    ("always upright", &[("rotation_step", "0")]),
    ("a pinned subspace as any other", &[("pinned_weight", "1")]),
    ("nothing has to arrive", &[("static_penalty", "0")]),
    ("never out of sight", &[("lost_threshold", "0")]),
    ("no camera shift", &[("global_motion", "false")]),
    ("arg max, not averaged", &[("averaging_radius", "0")]),
    ("no pinned subspace", &[("pinned", "0")]),
    ("learns from every frame", &[("update_distance_ratio", "0")]),
    (
        "learns what it hardly believes",
        &[("update_min_score", "0")],
    ),
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
    use crate::tracker::Preset;

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
