//! The appearance as printed (sections III-B to III-D): subspaces of whole vectors, compared on the Grassmann manifold.

use serde::{Deserialize, Serialize};

use crate::appearance::bag::{Bag, History};
use crate::appearance::model::{AppearanceModel, Comparison, Scratch, Vectors};
use crate::grassmann::subspace::{self, AffineSubspace};
use crate::params::table::Params;

/// The bag B (equation 3), and the patches that V is made of (equation 2).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Printed {
    history: History<Vec<f32>>,
    bag: Bag<AffineSubspace>,
}

impl Printed {
    fn remember(&mut self, vector: &[f32], params: &Params) {
        self.history.push(params, |newest| {
            newest.clear();
            newest.extend_from_slice(vector);
        });
    }
}

impl AppearanceModel for Printed {
    fn restart(&mut self, views: &[f32], params: &Params, _: &mut Scratch) {
        let len = params.feature_len();
        self.bag.admit_pinned(params, |entry| {
            subspace::fit(entry, views, len, params.basis_dim as usize);
        });
        self.history.vectors.clear();
        self.remember(&views[..len], params);
    }

    fn learn(&mut self, answer: &[f32], number: u64, params: &Params, scratch: &mut Scratch) {
        if Bag::<AffineSubspace>::admits(number, params) {
            // V: the answer and the previous frames (equation 2).
            let v = &mut scratch.vectors;
            v.clear();
            v.extend_from_slice(answer);
            for patch in &self.history.vectors {
                v.extend_from_slice(patch);
            }
            self.bag.admit(params, |entry| {
                subspace::fit(entry, v, answer.len(), params.basis_dim as usize);
            });
        }
        self.remember(answer, params);
    }

    fn load(&self, _: [&[f32]; 2], params: &Params, comparison: &mut Comparison) {
        comparison.printed.prepare(params);
        comparison.printed.set_bag(self.bag.entries.iter());
    }

    fn compare(
        &self,
        candidates: Vectors<'_>,
        _: &Params,
        comparison: &mut Comparison,
        distances: &mut Vec<f64>,
    ) {
        let history = self.history.vectors.iter().map(Vec::as_slice);
        distances.extend_from_slice(comparison.printed.distances(candidates.values, history));
    }

    fn query_products<'a>(&self, _: usize, _: &'a Comparison) -> Option<[&'a [f32]; 2]> {
        None
    }

    fn subspaces(&self, _: &Params) -> Vec<AffineSubspace> {
        self.bag.entries.iter().cloned().collect()
    }

    fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        let is_bounded = |values: &[f32]| values.iter().all(|value| value.abs() <= max);
        let is_patch = |patch: &Vec<f32>| patch.len() == params.feature_len() && is_bounded(patch);
        let is_entry = |entry: &AffineSubspace| {
            entry.is_valid_for(params) && is_bounded(&entry.mean) && is_bounded(&entry.basis)
        };
        self.history.is_valid_for(params, is_patch) && self.bag.is_valid_for(params, is_entry)
    }
}
