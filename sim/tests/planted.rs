//! Each planted fault is found within 200 seeds.

#![cfg(feature = "planted-faults")]

use bagtrack_sessions::PlantedFault;

#[test]
fn each_planted_fault_is_found() {
    for fault in PlantedFault::ALL {
        let found = sim::finds(fault, 200);
        assert!(found.is_some(), "{fault:?}");
    }
    // Without a planted fault there is nothing to find.
    assert!(sim::run(0).faults.is_empty());
}
