//! (C) The bag: the subspaces that were tracked before (equation 3).

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::appearance::augmentation;
use crate::appearance::background::Background;
use crate::appearance::span::{self, Scratch, Span};
use crate::appearance::subspace::{self, AffineSubspace};
use crate::features::quantized::QuantizedVector;
use crate::params::table::Params;

/// One affine subspace of the bag.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// The subspace as vectors, for the printed evaluation; empty with single-vector candidates.
    pub subspace: AffineSubspace,
    /// The vectors that it was made of, with single-vector candidates.
    pub templates: Vec<QuantizedVector>,
    /// The subspace as coefficients of the templates.
    #[serde(skip)]
    pub span: Span,
}

/// Up to K affine subspaces, oldest first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Bag {
    /// At least one once a session has begun.
    pub entries: VecDeque<Entry>,
}

impl Entry {
    /// Becomes the subspace of feature vectors, of length D one after the other. `scratch` has loaded the background.
    fn fit(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        let len = params.feature_len();
        if params.single_vector_candidate {
            let vectors = features.chunks_exact(len);
            self.templates
                .resize_with(vectors.len(), QuantizedVector::default);
            for (template, vector) in self.templates.iter_mut().zip(vectors) {
                template.set(vector);
            }
            self.span.fit(&self.templates, background, params, scratch);
        } else {
            let basis_dim = params.basis_dim as usize;
            subspace::fit(&mut self.subspace, features, len, basis_dim);
        }
    }

    /// Whether this may be an entry of a tracker with `params`, but for its subspace as vectors.
    pub fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        let counts = if params.single_vector_candidate {
            1..=(params.history as usize).max(augmentation::MAX_VIEWS) + 1
        } else {
            0..=0
        };
        let len = params.feature_len();
        counts.contains(&self.templates.len())
            && self
                .templates
                .iter()
                .all(|template| template.is_valid_for(len, max))
    }
}

impl Bag {
    /// Whether the bag is updated with the subspace found in frame `frame`: every W-th one (section III-C).
    pub fn admits(frame: u64, params: &Params) -> bool {
        frame.is_multiple_of(u64::from(params.update_every))
    }

    /// Appends the subspace of feature vectors, of length D one after the other. When the bag is full, the oldest entry
    /// that is not pinned leaves.
    pub fn admit(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        // The entry that leaves gives its memory to the new one.
        let mut latest = Entry::default();
        while self.entries.len() >= params.bag_size as usize {
            let leaves = self.entries.remove(params.pinned_entries());
            latest = leaves.expect("fewer entries are pinned than the bag has");
        }
        span::load(scratch, background);
        latest.fit(features, background, params, scratch);
        self.entries.push_back(latest);
    }

    /// Admits the subspace of a box that the user gave. Where the first entry is pinned, this one takes its place.
    pub fn admit_pinned(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        self.admit(features, background, params, scratch);
        if params.pinned_entries() > 0 {
            self.entries.rotate_right(1);
        }
    }

    /// Makes what follows from templates and background: after the background changed, and in a restored session.
    pub fn rebuild(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        if params.single_vector_candidate {
            span::load(scratch, background);
            for entry in &mut self.entries {
                let templates = &entry.templates;
                entry.span.fit(templates, background, params, scratch);
            }
        }
    }

    /// Their subspaces as vectors, for the printed evaluation.
    pub fn subspaces(&self) -> impl ExactSizeIterator<Item = &AffineSubspace> + Clone {
        self.entries.iter().map(|entry| &entry.subspace)
    }
}
