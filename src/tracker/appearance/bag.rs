//! (C) The bag: the looks of the target that the tracker remembers (equation 3).

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::tracker::appearance::background::Background;
use crate::tracker::appearance::span::{self, Combination};
use crate::tracker::linalg::jacobi::Spectrum;
use crate::tracker::features::quantized::Look;
use crate::tracker::appearance::augmentation;
use crate::tracker::appearance::subspace::AffineSubspace;
use crate::tracker::params::table::Params;

/// One affine subspace of the bag.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// The subspace as vectors: empty where candidates stand alone.
    pub subspace: AffineSubspace,
    /// What it was made of: kept where candidates stand alone, and while there is a background, with whose every change
    /// it is made anew.
    looks: Vec<Look>,
    /// The subspace as combinations of the looks, where candidates stand alone.
    #[serde(skip)]
    combination: Combination,
}

/// Up to K affine subspaces, oldest first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Bag {
    entries: VecDeque<Entry>,
}

/// Room for making entries.
#[derive(Debug, Default)]
pub(crate) struct Room {
    combination: span::Room,
    vectors: Vec<f32>,
    products: Vec<f32>,
    spectrum: Spectrum,
}

impl Entry {
    /// Becomes the subspace of feature vectors, of length D one after the other. `room` has taken the background.
    fn become_of(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        room: &mut Room,
    ) {
        let vectors = features.chunks_exact(params.feature_len());
        let count = if params.keeps_looks() {
            vectors.len()
        } else {
            0
        };
        self.looks.resize_with(count, Look::default);
        for (look, vector) in self.looks.iter_mut().zip(vectors) {
            look.keep(vector);
        }
        if params.candidate_alone {
            self.renew(background, params, room);
        } else {
            room.vectors.clear();
            room.vectors.extend_from_slice(features);
            self.whiten(background, params, room);
        }
    }

    /// Makes the subspace of the looks.
    fn renew(&mut self, background: &Background, params: &Params, room: &mut Room) {
        if params.candidate_alone {
            let room = &mut room.combination;
            self.combination
                .become_of(&self.looks, background, params, room);
            return;
        }
        let len = params.feature_len();
        room.vectors.clear();
        room.vectors.resize(self.looks.len() * len, 0.0);
        let vectors = room.vectors.chunks_exact_mut(len);
        for (look, vector) in self.looks.iter().zip(vectors) {
            look.add_to(vector, 1.0);
        }
        self.whiten(background, params, room);
    }

    /// Makes the subspace of the vectors in `room`.
    fn whiten(&mut self, background: &Background, params: &Params, room: &mut Room) {
        let len = params.feature_len();
        let Room {
            vectors, products, ..
        } = room;
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
            .become_of(&slices[..count], basis_dim, &mut room.spectrum);
    }

    /// Whether this may be an entry of a tracker with `params`, but for its subspace.
    pub fn is_sound(&self, params: &Params, greatest: f32) -> bool {
        let counts = if params.keeps_looks() {
            1..=(params.history as usize).max(augmentation::MOST) + 1
        } else {
            0..=0
        };
        let len = params.feature_len();
        counts.contains(&self.looks.len())
            && self.looks.iter().all(|look| look.is_sound(len, greatest))
    }

    /// The subspace as combinations, and of what: where candidates stand alone.
    #[inline(always)]
    pub fn combination(&self) -> (&Combination, &[Look]) {
        (&self.combination, &self.looks)
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
        room: &mut Room,
    ) {
        // The one that leaves has the room that the latest needs.
        let mut latest = Entry::default();
        while self.entries.len() >= params.bag_size as usize {
            let leaves = self.entries.remove(params.pinned as usize);
            latest = leaves.expect("fewer entries are pinned than the bag has");
        }
        room.combination.take(background);
        latest.become_of(features, background, params, room);
        self.entries.push_back(latest);
    }

    /// Takes the subspace of a look that the user pointed at, as [`admit`](Self::admit) does. Where such looks are pinned
    /// it is the first of them from now on; the oldest of those is an ordinary one then.
    pub fn point(
        &mut self,
        features: &[f32],
        background: &Background,
        params: &Params,
        room: &mut Room,
    ) {
        self.admit(features, background, params, room);
        if params.pinned > 0 {
            self.entries.rotate_right(1);
        }
    }

    /// Makes all subspaces anew where there is a background: the metric has changed.
    pub fn renew(&mut self, background: &Background, params: &Params, room: &mut Room) {
        if params.background_samples > 0 {
            self.renew_all(background, params, room);
        }
    }

    /// Makes what a snapshot does not carry: combinations, which are those that the session had.
    pub fn restore(&mut self, background: &Background, params: &Params, room: &mut Room) {
        if params.candidate_alone {
            self.renew_all(background, params, room);
        }
    }

    fn renew_all(&mut self, background: &Background, params: &Params, room: &mut Room) {
        room.combination.take(background);
        for entry in &mut self.entries {
            entry.renew(background, params, room);
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
