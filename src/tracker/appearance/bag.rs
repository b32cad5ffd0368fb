//! (C) The bag: the looks of the target that the tracker remembers (equation 3).

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::tracker::appearance::augmentation;
use crate::tracker::appearance::background::Background;
use crate::tracker::appearance::span::{self, Span};
use crate::tracker::appearance::subspace::AffineSubspace;
use crate::tracker::features::quantized::QuantizedVector;
use crate::tracker::linalg::jacobi::Spectrum;
use crate::tracker::params::table::Params;

/// One affine subspace of the bag.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// The subspace as vectors: empty where candidates stand alone.
    pub subspace: AffineSubspace,
    /// What it was made of: kept where candidates stand alone, and while there is a background, with whose every change
    /// it is made anew.
    templates: Vec<QuantizedVector>,
    /// The subspace as combinations of the looks, where candidates stand alone.
    #[serde(skip)]
    combination: Span,
}

/// Up to K affine subspaces, oldest first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Bag {
    entries: VecDeque<Entry>,
}

/// Room for making entries.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    combination: span::Scratch,
    vectors: Vec<f32>,
    products: Vec<f32>,
    spectrum: Spectrum,
}

impl Entry {
    /// Becomes the subspace of feature vectors, of length D one after the other. `scratch` has taken the background.
    fn fit(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        let vectors = features.chunks_exact(params.feature_len());
        let count = if params.keeps_templates() {
            vectors.len()
        } else {
            0
        };
        self.templates.resize_with(count, QuantizedVector::default);
        for (look, vector) in self.templates.iter_mut().zip(vectors) {
            look.set(vector);
        }
        if params.single_vector_candidate {
            self.rebuild(background, params, scratch);
        } else {
            scratch.vectors.clear();
            scratch.vectors.extend_from_slice(features);
            self.whiten(background, params, scratch);
        }
    }

    /// Makes the subspace of the looks.
    fn rebuild(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        if params.single_vector_candidate {
            let scratch = &mut scratch.combination;
            self.combination
                .fit(&self.templates, background, params, scratch);
            return;
        }
        let len = params.feature_len();
        scratch.vectors.clear();
        scratch.vectors.resize(self.templates.len() * len, 0.0);
        let vectors = scratch.vectors.chunks_exact_mut(len);
        for (look, vector) in self.templates.iter().zip(vectors) {
            look.add_to(vector, 1.0);
        }
        self.whiten(background, params, scratch);
    }

    /// Makes the subspace of the vectors in `scratch`.
    fn whiten(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        let len = params.feature_len();
        let Scratch {
            vectors, products, ..
        } = scratch;
        background
            .whitening()
            .apply(vectors, len, params.unit_length, products);
        // At most P + 1, and P is at most 10.
        let mut slices = [&[][..]; 11];
        let count = vectors.len() / len;
        for (slice, vector) in slices.iter_mut().zip(vectors.chunks_exact(len)) {
            *slice = vector;
        }
        let basis_dim = params.basis_dim as usize;
        self.subspace
            .fit(&slices[..count], basis_dim, &mut scratch.spectrum);
    }

    /// Whether this may be an entry of a tracker with `params`, but for its subspace.
    pub fn is_valid_for(&self, params: &Params, greatest: f32) -> bool {
        let counts = if params.keeps_templates() {
            1..=(params.history as usize).max(augmentation::MOST) + 1
        } else {
            0..=0
        };
        let len = params.feature_len();
        counts.contains(&self.templates.len())
            && self
                .templates
                .iter()
                .all(|look| look.is_valid_for(len, greatest))
    }

    /// The subspace as combinations, and of what: where candidates stand alone.
    #[inline(always)]
    pub fn combination(&self) -> (&Span, &[QuantizedVector]) {
        (&self.combination, &self.templates)
    }
}

impl Bag {
    /// Whether the bag is updated with the subspace found in frame `frame`: every W-th one (section III-C).
    pub fn admits(frame: u64, params: &Params) -> bool {
        frame.is_multiple_of(u64::from(params.update_every))
    }

    /// Takes the subspace of feature vectors, of length D one after the other, as the latest: while there are fewer than
    /// K the bag grows, then the oldest that is not pinned leaves.
    pub fn admit(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        // The one that leaves has the room that the latest needs.
        let mut latest = Entry::default();
        while self.entries.len() >= params.bag_size as usize {
            let leaves = self.entries.remove(params.pinned as usize);
            latest = leaves.expect("fewer entries are pinned than the bag has");
        }
        scratch.combination.take(background);
        latest.fit(features, background, params, scratch);
        self.entries.push_back(latest);
    }

    /// Takes the subspace of a look that the user pointed at, as [`admit`](Self::admit) does. Where such looks are pinned
    /// it is the first of them from now on; the oldest of those is an ordinary one then.
    pub fn admit_pinned(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        self.admit(features, background, params, scratch);
        if params.pinned > 0 {
            self.entries.rotate_right(1);
        }
    }

    /// Makes all subspaces anew where there is a background: the metric has changed.
    pub fn rebuild(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        if params.background_samples > 0 {
            self.rebuild_all(background, params, scratch);
        }
    }

    /// Makes what a snapshot does not carry: combinations, which are those that the session had.
    pub fn restore(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        if params.single_vector_candidate {
            self.rebuild_all(background, params, scratch);
        }
    }

    fn rebuild_all(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        scratch.combination.take(background);
        for entry in &mut self.entries {
            entry.rebuild(background, params, scratch);
        }
    }

    /// The entries, oldest first; never none once a session has begun.
    pub fn entries(&self) -> &VecDeque<Entry> {
        &self.entries
    }

    /// Their subspaces as vectors, where candidates do not stand alone.
    pub fn subspaces(&self) -> impl ExactSizeIterator<Item = &AffineSubspace> + Clone {
        self.entries.iter().map(|entry| &entry.subspace)
    }
}
