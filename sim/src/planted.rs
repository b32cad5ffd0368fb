//! Faults that are planted in the code must be found.

use crate::world::{Outcome, run};
use bagtrack_sessions::{PlantedFault, plant};

/// The run of the first seed that finds a fault, of so many.
pub fn finds(fault: PlantedFault, seeds: u64) -> Option<Outcome> {
    plant(Some(fault));
    let found = (0..seeds)
        .map(run)
        .find(|outcome| !outcome.faults.is_empty());
    plant(None);
    found
}
