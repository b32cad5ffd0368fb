//! Room to work in, one for each thread.
//!
//! A step works on a megabyte: all candidates and the bag in double precision. Nothing of it outlives the step, so
//! it belongs to the thread, not to the session: ten thousand sessions would need ten gigabytes of it. The hazard of
//! shared room is what the last session left in it: so every step begins with [`Workspace::prepare`], and the bag is taken
//! over unless it is known to be the one that is there.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use super::Evaluation;
use super::eigen::Spectrum;
use super::motion::Particle;
use super::patch::PatchCutter;
use super::state::State;

thread_local! {
    static FREE: Cell<Option<Box<Workspace>>> = const { Cell::new(None) };
}

/// The name of one bag in one state, given to no other in this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BagStamp(u64);

impl BagStamp {
    /// A new one, for a bag that has changed.
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// What a step needs beside the state.
#[derive(Default)]
pub(super) struct Workspace {
    pub evaluation: Evaluation,
    pub cutter: PatchCutter,
    pub spectrum: Spectrum,
    /// The next particles, swapped with those of the state.
    pub proposed: Vec<Particle>,
    pub cumulative: Vec<f64>,
    /// The feature vector of the answer.
    pub tracked: Vec<f32>,
    bag: Option<(BagStamp, super::Params)>,
}

impl Workspace {
    /// Calls `work` with this thread's workspace. Where it panics, the next call gets a new one.
    pub fn with<T>(work: impl FnOnce(&mut Self) -> T) -> T {
        let mut workspace = FREE.take().unwrap_or_default();
        let result = work(&mut workspace);
        FREE.set(Some(workspace));
        result
    }

    /// Gets ready for `state`, whose bag is called `stamp`.
    pub fn prepare(&mut self, state: &State, stamp: BagStamp) {
        let is_there = self
            .bag
            .as_ref()
            .is_some_and(|(bag, params)| *bag == stamp && *params == state.params);
        if !is_there {
            self.bag = None;
            self.evaluation.prepare(&state.params);
            self.evaluation.set_bag(state.bag.entries().iter());
            self.bag = Some((stamp, state.params.clone()));
        }
    }
}
