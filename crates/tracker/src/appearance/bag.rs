//! (C) The bag: the subspaces that were tracked before (equation 3), and the history that the next one is made of.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::params::table::Params;

/// Up to K affine subspaces, each in the form of an `E`, oldest first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Bag<E> {
    /// The entries: at least one once a session has begun.
    pub entries: VecDeque<E>,
}

impl<E: Default> Bag<E> {
    /// Whether the bag is updated with the subspace found in frame `frame`: every W-th one (section III-C).
    pub fn admits(frame: u64, params: &Params) -> bool {
        frame.is_multiple_of(u64::from(params.update_every))
    }

    /// Appends the entry that `fit` makes. When the bag is full, the oldest entry that is not pinned leaves, and gives
    /// its memory to the new one.
    pub fn admit(&mut self, params: &Params, fit: impl FnOnce(&mut E)) {
        let mut latest = E::default();
        while self.entries.len() >= params.bag_size as usize {
            let leaves = self.entries.remove(params.pinned_entries());
            latest = leaves.expect("fewer entries are pinned than the bag has");
        }
        fit(&mut latest);
        self.entries.push_back(latest);
    }

    /// Admits the subspace of a box that the user gave. Where `params` pin the first entry, the new entry becomes the
    /// first; the one that was pinned is now an entry as any other.
    pub fn admit_pinned(&mut self, params: &Params, fit: impl FnOnce(&mut E)) {
        self.admit(params, fit);
        if params.pinned_entries() > 0 {
            self.entries.rotate_right(1);
        }
    }

    /// Whether there are as many entries as a tracker with `params` may have, all of them valid.
    pub fn is_valid_for(&self, params: &Params, is_valid: impl FnMut(&E) -> bool) -> bool {
        (1..=params.bag_size as usize).contains(&self.entries.len())
            && self.entries.iter().all(is_valid)
    }
}

/// The feature vectors of the last tracked frames, each in the form of a `V`, newest first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct History<V> {
    /// The vectors: 1 to P once a session has begun.
    pub vectors: VecDeque<V>,
}

impl<V: Default> History<V> {
    /// Appends the newest vector, which `set` makes. When there are P, the oldest leaves, and gives its memory to the
    /// newest.
    pub fn push(&mut self, params: &Params, set: impl FnOnce(&mut V)) {
        let mut newest = V::default();
        if self.vectors.len() >= params.history as usize {
            newest = self.vectors.pop_back().unwrap_or_default();
        }
        set(&mut newest);
        self.vectors.push_front(newest);
    }

    /// Whether there are as many vectors as a tracker with `params` may have, all of them valid.
    pub fn is_valid_for(&self, params: &Params, is_valid: impl FnMut(&V) -> bool) -> bool {
        (1..=params.history as usize).contains(&self.vectors.len())
            && self.vectors.iter().all(is_valid)
    }
}
