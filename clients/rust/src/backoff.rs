//! The pauses before a request is sent again.

use crate::network::Carrier;
use std::time::Duration;
use tokio::time::Instant;

const FIRST: Duration = Duration::from_millis(100);
const LONGEST: Duration = Duration::from_secs(5);

/// Growing pauses, until the time for retries is up.
pub struct Backoff {
    begin: Instant,
    retry_for: Duration,
    next: Duration,
    carrier: Carrier,
}

impl Backoff {
    pub fn new(retry_for: Duration, carrier: Carrier) -> Self {
        Self {
            begin: Instant::now(),
            retry_for,
            next: FIRST,
            carrier,
        }
    }

    /// Waits, at least as long as the service asks for (`asked`). Returns false without waiting if the time would be up
    /// by then.
    pub async fn wait(&mut self, asked: Option<Duration>) -> bool {
        // The pauses are random, so that clients that were cut off together do not come back together.
        let own = self.next.mul_f64(0.5 + self.carrier.fraction() / 2.0);
        let pause = own.max(asked.unwrap_or_default());
        self.next = (2 * self.next).min(LONGEST);
        if self.begin.elapsed().saturating_add(pause) > self.retry_for {
            return false;
        }
        tokio::time::sleep(pause).await;
        true
    }
}

/// The pauses between the recoveries of one call. The first recovery comes at once. If every replica loses the session
/// again, the recoveries end with the time for retries.
pub struct RecoveryBackoff {
    backoff: Backoff,
    has_recovered: bool,
}

impl RecoveryBackoff {
    pub fn new(backoff: Backoff) -> Self {
        Self {
            backoff,
            has_recovered: false,
        }
    }

    /// Waits before the next recovery. Returns false without waiting if the time would be up by then.
    pub async fn wait(&mut self) -> bool {
        let is_first = !std::mem::replace(&mut self.has_recovered, true);
        is_first || self.backoff.wait(None).await
    }
}
