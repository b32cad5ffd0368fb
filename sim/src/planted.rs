//! Tries whether the simulation finds the faults that are planted in the code.

use crate::world::{Outcome, run};
use bagtrack_sessions::{PlantedFault, plant};

/// The first of `seeds` runs that finds this planted fault.
pub fn finds(fault: PlantedFault, seeds: u64) -> Option<Outcome> {
    plant(Some(fault));
    let found = (0..seeds)
        .map(run)
        .find(|outcome| !outcome.faults.is_empty());
    plant(None);
    found
}
