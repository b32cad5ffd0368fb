//! What the tests of stores share.

use super::record::{Record, Version};
use crate::sessions::opening::Opening;
use crate::sessions::owner::Owner;
use crate::sessions::targets::Estimates;
use bagtrack_tracker::{Estimate, Rect, Status};
use std::time::Duration;

/// A record of a session that was opened at frame 0, at this frame.
pub(crate) fn record(incarnation: u64, frame: u64) -> Record {
    let estimate = Estimate {
        frame: 0,
        target: Rect::new(1.0, 2.0, 30.0, 40.0),
        score: 1.0,
        status: Status::Tracking,
    };
    Record {
        version: Version::first(frame),
        owner: Owner::named("ann"),
        opening: Opening {
            request: [7; 32],
            estimates: Estimates::One(estimate),
            expires: 9,
            incarnation,
        },
        state: vec![1, 2, 3],
        ttl: Duration::from_secs(60),
    }
}
