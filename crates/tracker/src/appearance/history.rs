//! The feature vectors of the last tracked frames.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::features::quantized::QuantizedVector;
use crate::params::table::Params;

/// The feature vectors of the last tracked frames, newest first, 1 to P of them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct History {
    /// For the printed evaluation; none with single-vector candidates.
    pub exact: VecDeque<Vec<f32>>,
    /// With single-vector candidates, whose subspaces are made of quantised vectors.
    quantized: VecDeque<QuantizedVector>,
}

impl History {
    /// Makes the vector of length D that `features` begins with the newest.
    pub fn push(&mut self, features: &[f32], params: &Params) {
        let newest = &features[..params.feature_len()];
        let max = params.history as usize;
        if params.single_vector_candidate {
            let mut vector = replaced(&mut self.quantized, max);
            vector.set(newest);
            self.quantized.push_front(vector);
        } else {
            let mut vector = replaced(&mut self.exact, max);
            vector.clear();
            vector.extend_from_slice(newest);
            self.exact.push_front(vector);
        }
    }

    /// Appends all vectors to `out`.
    pub fn append_to(&self, out: &mut Vec<f32>, params: &Params) {
        for vector in &self.exact {
            out.extend_from_slice(vector);
        }
        for vector in &self.quantized {
            let first = out.len();
            out.resize(first + params.feature_len(), 0.0);
            vector.write(&[], &mut out[first..]);
        }
    }

    /// Forgets all vectors.
    pub fn clear(&mut self) {
        self.exact.clear();
        self.quantized.clear();
    }

    /// Whether this may be the history of a tracker with `params`, no absolute value above `max`.
    pub fn is_valid_for(&self, params: &Params, max: f32) -> bool {
        let (len, counts) = (params.feature_len(), 1..=params.history as usize);
        if params.single_vector_candidate {
            let is_valid = |vector: &QuantizedVector| vector.is_valid_for(len, max);
            self.exact.is_empty()
                && counts.contains(&self.quantized.len())
                && self.quantized.iter().all(is_valid)
        } else {
            let is_valid = |vector: &Vec<f32>| {
                vector.len() == len && vector.iter().all(|value| value.abs() <= max)
            };
            self.quantized.is_empty()
                && counts.contains(&self.exact.len())
                && self.exact.iter().all(is_valid)
        }
    }
}

/// The memory for the newest vector: that of the oldest, which leaves where there are `max`.
fn replaced<T: Default>(vectors: &mut VecDeque<T>, max: usize) -> T {
    match vectors.len() < max {
        true => T::default(),
        false => vectors.pop_back().unwrap_or_default(),
    }
}
