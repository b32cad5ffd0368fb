//! What the target has looked like: one of two models, with which candidates are compared.
//!
//! A step asks for the same things of both; this is the only place that tells them apart.

use serde::{Deserialize, Serialize};

use crate::appearance::point_distance::PointDistance;
use crate::appearance::printed::Printed;
use crate::appearance::single_vector::SingleVector;
use crate::appearance::{background, span};
use crate::grassmann::evaluation::Evaluation;
use crate::grassmann::subspace::AffineSubspace;
use crate::params::table::Params;

/// The bag of affine subspaces, and what the next one is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Appearance {
    /// As printed: a candidate makes its subspace with the history.
    Printed(Printed),
    /// The extension: a candidate's subspace is its own vector alone.
    SingleVector(SingleVector),
}

/// Feature vectors of length D, one after the other, with the model's [`mean`](AppearanceModel::mean) subtracted, and
/// their squared lengths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vectors<'a> {
    pub values: &'a [f32],
    pub squares: &'a [f32],
}

/// What candidates are compared with in a frame. A thread has one value, for sessions of either model.
#[derive(Debug, Default)]
pub(crate) struct Comparison {
    pub printed: Evaluation,
    pub single_vector: PointDistance,
}

/// Buffers for learning.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    pub background: background::Scratch,
    pub span: span::Scratch,
    pub vectors: Vec<f32>,
}

/// What a step asks of the target's appearance. Vectors are feature vectors of length D, one after the other.
pub(crate) trait AppearanceModel {
    /// Starts from a box that the user gave. `views` are the vectors of its image, the first upright, the others
    /// rotated: the bag gains their subspace, pinned where `params` pin the first entry, and the history begins anew.
    fn restart(&mut self, views: &[f32], params: &Params, scratch: &mut Scratch);

    /// (C) Adds the vector of the answer to frame `number` to the history and, every W-th frame, a subspace to the bag.
    fn learn(&mut self, answer: &[f32], number: u64, params: &Params, scratch: &mut Scratch);

    /// Loads the bag, and two vectors for [`query_products`](Self::query_products).
    fn load(&self, queries: [&[f32]; 2], params: &Params, comparison: &mut Comparison);

    /// (D) Appends the distances of each candidate to all entries of the bag (equation 4).
    fn compare(
        &self,
        candidates: Vectors<'_>,
        params: &Params,
        comparison: &mut Comparison,
        distances: &mut Vec<f64>,
    );

    /// The products of the `count` candidates that were compared last with the two vectors given to
    /// [`load`](Self::load); none where the model does not compute them.
    fn query_products<'a>(
        &self,
        count: usize,
        comparison: &'a Comparison,
    ) -> Option<[&'a [f32]; 2]>;

    /// The bag as vectors, oldest first.
    fn subspaces(&self, params: &Params) -> Vec<AffineSubspace>;

    /// Whether this may be the appearance of a tracker with `params`, with no absolute value above `max`.
    fn is_valid_for(&self, params: &Params, max: f32) -> bool;

    /// How many areas beside the target [`learn_background`](Self::learn_background) wants of frame `number`.
    fn background_wanted(&self, _number: u64, _params: &Params) -> usize {
        0
    }

    /// Learns the vectors of areas beside the target.
    fn learn_background(&mut self, _vectors: &[f32], _params: &Params, _scratch: &mut Scratch) {}

    /// What is subtracted from vectors before they are compared: the background's mean; empty where nothing is
    /// subtracted.
    fn mean(&self) -> &[f32] {
        &[]
    }

    /// Computes what a snapshot does not carry. Where `known` has the same samples and templates, what follows from
    /// them is copied from `known`.
    fn restore(&mut self, _known: Option<&Appearance>, _params: &Params, _scratch: &mut Scratch) {}
}

impl Appearance {
    /// The empty model that `params` ask for.
    pub fn new(params: &Params) -> Self {
        match params.single_vector_candidate {
            true => Self::SingleVector(SingleVector::default()),
            false => Self::Printed(Printed::default()),
        }
    }

    pub fn model(&self) -> &dyn AppearanceModel {
        match self {
            Self::Printed(model) => model,
            Self::SingleVector(model) => model,
        }
    }

    pub fn model_mut(&mut self) -> &mut dyn AppearanceModel {
        match self {
            Self::Printed(model) => model,
            Self::SingleVector(model) => model,
        }
    }

    /// Whether this is the model that `params` ask for, with valid contents.
    pub fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(&Self::new(params))
            && self.model().is_valid_for(params, max)
    }
}
