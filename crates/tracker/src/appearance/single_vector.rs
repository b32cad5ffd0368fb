//! The extended appearance: a candidate's subspace is its own vector, brought to unit length under the metric of the
//! background.
//!
//! As one of P + 1 columns of V (equation 2) a candidate hardly counts beside the history that it shares with all
//! others. The entries of the bag are subspaces of several vectors, as in the paper, kept as [`Span`]s.

use serde::{Deserialize, Serialize};

use crate::appearance::background::{self, Background};
use crate::appearance::bag::{Bag, History};
use crate::appearance::model::{Appearance, AppearanceModel, Comparison, Scratch, Vectors};
use crate::appearance::span::{self, Span};
use crate::appearance::{bag_matrix, point_distance};
use crate::features::quantized::QuantizedVector;
use crate::grassmann::subspace::AffineSubspace;
use crate::params::table::Params;

/// How many rotated copies an entry has at most beside the box's own vector, when the first box's image is augmented.
const MAX_AUGMENTED: usize = 2;

/// The bag (equation 3), the history, and the background, under whose metric vectors are compared.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct SingleVector {
    history: History<QuantizedVector>,
    bag: Bag<Span>,
    background: Background,
}

impl SingleVector {
    /// Fits all entries anew to the present background.
    fn rebuild(&mut self, params: &Params, scratch: &mut span::Scratch) {
        span::load(scratch, &self.background);
        for entry in &mut self.bag.entries {
            entry.refit(&self.background, params, scratch);
        }
    }
}

impl AppearanceModel for SingleVector {
    fn restart(&mut self, views: &[f32], params: &Params, scratch: &mut Scratch) {
        span::load(&mut scratch.span, &self.background);
        self.bag.admit_pinned(params, |entry| {
            entry.fit(views, &self.background, params, &mut scratch.span);
        });
        self.history.vectors.clear();
        let first = &views[..params.feature_len()];
        self.history.push(params, |newest| newest.set(first));
    }

    fn learn(&mut self, answer: &[f32], number: u64, params: &Params, scratch: &mut Scratch) {
        if Bag::<Span>::admits(number, params) {
            let Scratch { span, vectors, .. } = scratch;
            vectors.clear();
            vectors.extend_from_slice(answer);
            for vector in &self.history.vectors {
                let first = vectors.len();
                vectors.resize(first + answer.len(), 0.0);
                vector.write(&[], &mut vectors[first..]);
            }
            span::load(span, &self.background);
            self.bag.admit(params, |entry| {
                entry.fit(vectors, &self.background, params, span);
            });
        }
        self.history.push(params, |newest| newest.set(answer));
    }

    fn load(&self, queries: [&[f32]; 2], params: &Params, comparison: &mut Comparison) {
        let matrix = &mut comparison.single_vector.matrix;
        let (bag, len) = (&self.bag, params.feature_len());
        bag_matrix::load(matrix, bag, &self.background, queries, len);
    }

    fn compare(
        &self,
        candidates: Vectors<'_>,
        params: &Params,
        comparison: &mut Comparison,
        distances: &mut Vec<f64>,
    ) {
        let compared = &mut comparison.single_vector;
        point_distance::distances(compared, candidates, params, distances);
    }

    fn query_products<'a>(
        &self,
        count: usize,
        comparison: &'a Comparison,
    ) -> Option<[&'a [f32]; 2]> {
        Some(comparison.single_vector.query_products(count))
    }

    /// The subspaces of the entries' templates, under the plain metric.
    fn subspaces(&self, params: &Params) -> Vec<AffineSubspace> {
        let entries = self.bag.entries.iter();
        entries.map(|entry| entry.subspace(params)).collect()
    }

    fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        let len = params.feature_len();
        let is_vector = |vector: &QuantizedVector| vector.is_valid_for(len, max);
        let most = (params.history as usize).max(MAX_AUGMENTED) + 1;
        let is_entry = |entry: &Span| {
            (1..=most).contains(&entry.templates.len()) && entry.templates.iter().all(is_vector)
        };
        self.history.is_valid_for(params, is_vector)
            && self.bag.is_valid_for(params, is_entry)
            && self.background.is_valid_for(params, max)
    }

    fn background_wanted(&self, number: u64, params: &Params) -> usize {
        Background::wanted(number, params)
    }

    fn learn_background(&mut self, vectors: &[f32], params: &Params, scratch: &mut Scratch) {
        self.background
            .rebuild(vectors, params, &mut scratch.background);
        self.rebuild(params, &mut scratch.span);
    }

    fn mean(&self) -> &[f32] {
        &self.background.mean
    }

    fn restore(&mut self, known: Option<&Appearance>, params: &Params, scratch: &mut Scratch) {
        let known = match known {
            Some(Appearance::SingleVector(known)) => known,
            _ => &Self::default(),
        };
        if !self.background.take_known(&known.background) {
            background::learn(&mut self.background, params, &mut scratch.background);
            self.rebuild(params, &mut scratch.span);
            return;
        }
        span::load(&mut scratch.span, &self.background);
        for entry in &mut self.bag.entries {
            let mut known = known.bag.entries.iter();
            match known.find(|known| known.templates == entry.templates) {
                Some(known) => entry.clone_from(known),
                None => entry.refit(&self.background, params, &mut scratch.span),
            }
        }
    }
}
