//! The least rate at which a client has to send or to take bytes.
//!
//! Only time in which the service waits for the client counts. The client has a fixed time to use up. Each byte that is
//! transferred pays some of it back and, where that is allowed, some in advance. So a client that now and then moves a
//! byte does not hold its connection for long.

use bagtrack_sessions::clock::{self, Instant, Sleep, sleep_until};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

/// How long a client may be waited for.
#[derive(Debug)]
pub struct LeastRate {
    /// Bytes a second.
    min_rate: u32,
    /// Time that the client may still be waited for.
    left: Duration,
    /// The most that `left` can become by bytes.
    most: Duration,
    /// Since when the service waits for the client; `None` while it does not wait.
    since: Option<Instant>,
    late: Pin<Box<Sleep>>,
}

impl LeastRate {
    /// A least rate of `min_rate` bytes a second, with the time `grace` to use up.
    pub fn new(grace: Duration, min_rate: u32) -> Self {
        Self {
            min_rate: min_rate.max(1),
            left: grace,
            most: grace,
            since: None,
            late: Box::pin(sleep_until(clock::now())),
        }
    }

    /// Lets bytes that come early pay for a longer wait, up to `most`.
    pub fn with_credit(self, most: Duration) -> Self {
        Self {
            most: most.max(self.most),
            ..self
        }
    }

    /// Gives the client its whole time again.
    pub fn reset(&mut self) {
        (self.left, self.since) = (self.most, None);
    }

    /// Notes that `bytes` bytes were transferred.
    pub fn moved(&mut self, bytes: usize) {
        self.pause();
        let paid = bytes as f64 / f64::from(self.min_rate);
        let left = self.left.saturating_add(Duration::from_secs_f64(paid));
        self.left = left.min(self.most);
    }

    /// Notes that the service does not wait for the client any more.
    pub fn pause(&mut self) {
        if let Some(since) = self.since.take() {
            self.left = self.left.saturating_sub(since.elapsed());
        }
    }

    /// Charges `time` to the client for what it sent. Returns whether any time is left.
    pub fn spend(&mut self, time: Duration) -> bool {
        self.pause();
        self.left = self.left.saturating_sub(time);
        !self.left.is_zero()
    }

    /// Waits for the client; ready when it is too slow.
    pub fn poll_late(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        if self.since.is_none() {
            let now = clock::now();
            self.since = Some(now);
            self.late.as_mut().reset(now + self.left);
        }
        self.late.as_mut().poll(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures_util::poll;
    use std::future::poll_fn;
    use tokio::time::advance;

    const GRACE: Duration = Duration::from_secs(30);

    async fn is_late(rate: &mut LeastRate) -> bool {
        poll!(poll_fn(|cx| rate.poll_late(cx))).is_ready()
    }

    #[tokio::test(start_paused = true)]
    async fn time_is_used_up_while_the_client_is_waited_for_and_paid_back_by_bytes() {
        let mut rate = LeastRate::new(GRACE, 1000);
        assert!(!is_late(&mut rate).await);
        advance(Duration::from_secs(29)).await;
        // A byte pays a thousandth of a second back.
        rate.moved(1);
        // Nobody waits for the client.
        advance(Duration::from_secs(100)).await;
        assert!(!is_late(&mut rate).await);
        advance(Duration::from_secs(2)).await;
        assert!(is_late(&mut rate).await, "it has used up its time");
        rate.moved(40_000);
        assert!(!is_late(&mut rate).await);
        advance(GRACE - Duration::from_secs(1)).await;
        assert!(!is_late(&mut rate).await);
        advance(Duration::from_secs(2)).await;
        assert!(
            is_late(&mut rate).await,
            "bytes pay for no more than the grace"
        );
    }

    #[tokio::test(start_paused = true)]
    async fn bytes_that_come_early_pay_for_a_longer_wait_where_that_is_allowed() {
        let mut rate = LeastRate::new(GRACE, 1000).with_credit(2 * GRACE);
        rate.moved(1_000_000);
        assert!(!is_late(&mut rate).await);
        advance(2 * GRACE - Duration::from_secs(1)).await;
        assert!(!is_late(&mut rate).await);
        advance(Duration::from_secs(2)).await;
        assert!(is_late(&mut rate).await);
    }
}
