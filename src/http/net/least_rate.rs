//! The least rate at which a client has to send or to take bytes.
//!
//! Only the time counts in which the service waits for the client. The client may use up a fixed time of it; bytes that go
//! over pay some of it back. So a client that now and then moves a byte does not hold its connection for long.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::time::{Instant, Sleep, sleep_until};

/// How long a client may be waited for.
#[derive(Debug)]
pub struct LeastRate {
    grace: Duration,
    /// Bytes a second.
    min_rate: u32,
    /// Time that was waited, less what bytes have paid back.
    waited: Duration,
    /// Since when the service waits.
    since: Option<Instant>,
    late: Pin<Box<Sleep>>,
}

impl LeastRate {
    /// `min_rate` bytes a second, with `grace` to use up.
    pub fn new(grace: Duration, min_rate: u32) -> Self {
        Self {
            grace,
            min_rate: min_rate.max(1),
            waited: Duration::ZERO,
            since: None,
            late: Box::pin(sleep_until(Instant::now())),
        }
    }

    /// So many bytes went over.
    pub fn moved(&mut self, bytes: usize) {
        self.pause();
        let paid = bytes as f64 / f64::from(self.min_rate);
        self.waited = self.waited.saturating_sub(Duration::from_secs_f64(paid));
    }

    /// The service does not wait for the client any more.
    pub fn pause(&mut self) {
        if let Some(since) = self.since.take() {
            self.waited += since.elapsed();
        }
    }

    /// Waits for the client; ready when it is too slow.
    pub fn poll_late(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        if self.since.is_none() {
            let now = Instant::now();
            self.since = Some(now);
            let left = self.grace.saturating_sub(self.waited);
            self.late.as_mut().reset(now + left);
        }
        self.late.as_mut().poll(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures_util::poll;
    use std::future::poll_fn;

    const GRACE: Duration = Duration::from_secs(30);

    #[tokio::test]
    async fn time_is_used_up_while_the_client_is_waited_for_and_paid_back_by_bytes() {
        let mut rate = LeastRate::new(GRACE, 1000);
        // A byte in 29 seconds pays a thousandth of a second back.
        for is_late in [false, true] {
            let late = poll!(poll_fn(|cx| rate.poll_late(cx)));
            assert!(late.is_pending());
            rate.since = Instant::now().checked_sub(Duration::from_secs(29));
            rate.moved(1);
            assert_eq!(rate.waited > GRACE, is_late, "{rate:?}");
        }
        let late = poll_fn(|cx| rate.poll_late(cx));
        let late = tokio::time::timeout(GRACE / 2, late).await;
        assert!(late.is_ok(), "it has used up its time");
        rate.moved(40_000);
        assert!(poll!(poll_fn(|cx| rate.poll_late(cx))).is_pending());
    }
}
