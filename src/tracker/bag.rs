//! (C) The bag: the looks of the target that the tracker remembers (equation 3).

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::background::Metric;
use super::look::Look;
use super::{AffineSubspace, Params};

/// One affine subspace of the bag.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    pub subspace: AffineSubspace,
    /// What it was made of; kept while there is a background, with whose every change it is made anew.
    looks: Vec<Look>,
}

/// Up to K affine subspaces, oldest first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Bag {
    entries: VecDeque<Entry>,
}

impl Entry {
    /// The subspace of feature vectors, of length D one after the other.
    pub fn new(features: &[f32], metric: &Metric, params: &Params) -> Self {
        let looks = if params.background_samples > 0 {
            let vectors = features.chunks_exact(params.feature_len());
            vectors.map(Look::new).collect()
        } else {
            Vec::new()
        };
        Self {
            subspace: subspace(features.to_vec(), metric, params),
            looks,
        }
    }

    /// Whether this may be an entry of a tracker with `params`, but for its subspace.
    pub fn is_sound(&self, params: &Params, greatest: f32) -> bool {
        let counts = if params.background_samples > 0 {
            1..=params.history as usize + 1
        } else {
            0..=0
        };
        let len = params.feature_len();
        counts.contains(&self.looks.len())
            && self.looks.iter().all(|look| look.is_sound(len, greatest))
    }
}

/// The subspace of feature vectors as the metric sees them.
fn subspace(mut vectors: Vec<f32>, metric: &Metric, params: &Params) -> AffineSubspace {
    let len = params.feature_len();
    metric.apply(&mut vectors, len, params.unit_length, &mut Vec::new());
    let vectors: Vec<&[f32]> = vectors.chunks_exact(len).collect();
    AffineSubspace::of(&vectors, params.basis_dim as usize)
}

impl Bag {
    /// A bag that knows the first frame only.
    pub fn new(first: Entry) -> Self {
        Self {
            entries: VecDeque::from([first]),
        }
    }

    /// Whether the bag is updated with the subspace found in frame `frame`: every W-th one (section III-C).
    pub fn admits(frame: u64, params: &Params) -> bool {
        frame.is_multiple_of(u64::from(params.update_every))
    }

    /// Takes the latest subspace: while there are fewer than K the bag grows, then the oldest that is not pinned leaves.
    pub fn admit(&mut self, latest: Entry, params: &Params) {
        while self.entries.len() >= params.bag_size as usize {
            self.entries.remove(params.pinned as usize);
        }
        self.entries.push_back(latest);
    }

    /// Takes the subspace of a look that the user pointed at. Where such looks are pinned it is the first of them from
    /// now on; the oldest of those is an ordinary one then.
    pub fn point(&mut self, latest: Entry, params: &Params) {
        self.admit(latest, params);
        if params.pinned > 0 {
            self.entries.rotate_right(1);
        }
    }

    /// Makes all subspaces anew where there is a background: the metric may have changed.
    pub fn rebuild_if_needed(&mut self, metric: &Metric, params: &Params) {
        if params.background_samples == 0 {
            return;
        }
        for entry in &mut self.entries {
            let mut vectors = Vec::with_capacity(entry.looks.len() * params.feature_len());
            entry
                .looks
                .iter()
                .for_each(|look| look.append_to(&mut vectors));
            entry.subspace = subspace(vectors, metric, params);
        }
    }

    /// The entries, oldest first; never none.
    pub fn entries(&self) -> &VecDeque<Entry> {
        &self.entries
    }

    /// Their subspaces.
    pub fn subspaces(&self) -> impl ExactSizeIterator<Item = &AffineSubspace> + Clone {
        self.entries.iter().map(|entry| &entry.subspace)
    }
}
