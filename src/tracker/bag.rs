//! (C) The bag: the looks of the target that the tracker remembers (equation 3).

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::eigen::Spectrum;
use super::{AffineSubspace, Params};

/// Up to K affine subspaces, oldest first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Bag {
    entries: VecDeque<AffineSubspace>,
}

impl Bag {
    /// A bag that knows the first frame only.
    pub fn new(first: AffineSubspace) -> Self {
        Self {
            entries: VecDeque::from([first]),
        }
    }

    /// Whether the bag is updated with the subspace found in frame `frame`: every W-th one (section III-C).
    pub fn admits(frame: u64, params: &Params) -> bool {
        frame.is_multiple_of(u64::from(params.update_every))
    }

    /// Takes the subspace of `vectors`: while there are fewer than K the bag grows, then the oldest leaves.
    pub fn admit(&mut self, vectors: &[&[f32]], params: &Params, spectrum: &mut Spectrum) {
        let basis_dim = params.basis_dim as usize;
        let mut oldest = None;
        while self.entries.len() >= params.bag_size as usize {
            oldest = self.entries.pop_front();
        }
        let latest = match oldest {
            Some(mut entry) => {
                entry.become_of(vectors, basis_dim, spectrum);
                entry
            }
            None => AffineSubspace::of(vectors, basis_dim),
        };
        self.entries.push_back(latest);
    }

    /// The subspaces, oldest first; never none.
    pub fn entries(&self) -> &VecDeque<AffineSubspace> {
        &self.entries
    }
}
