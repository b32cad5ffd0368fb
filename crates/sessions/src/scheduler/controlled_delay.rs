//! When a client's requests wait too long: controlled delay with the newest first (Maurer, *Fail at Scale*, 2015, after
//! CoDel, RFC 8289).
//!
//! A burst fills a queue for a moment. A queue that stays helps nobody: no more gets done, and every answer is late. So
//! after an interval in which no wait was within the target, the flow is overloaded: its newest request goes first and
//! is answered in time, and a request that has waited twice the target is refused if a newer one waits. A client that
//! sends one request at a time is never refused. The overload ends after an interval in which no request was refused,
//! and one was alone in its flow and waited no longer than the target.

use std::time::Duration;

/// In each interval of this length a queue has to be short once. A burst of this length is worked off in order.
const INTERVAL: Duration = Duration::from_millis(500);

/// Whether a flow's requests wait too long, judged by the wait of its oldest request.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ControlledDelay {
    /// When this interval ends.
    until: Duration,
    /// Whether the queue was long all the time in this interval so far.
    is_long: bool,
    /// Whether a request was refused in this interval: a queue that is short because of that would be long again in a
    /// moment.
    has_refused: bool,
    is_overloaded: bool,
}

/// Which request of a flow is next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// The oldest.
    Oldest,
    /// The newest.
    Newest,
    /// The oldest request is to be refused, and then [`ControlledDelay::order`] to be called again.
    Refuse,
}

impl ControlledDelay {
    /// Decides which request of the flow is next at `now`, when its turn comes. `waited` is how long the oldest request
    /// has waited, `is_alone` whether it is the flow's only one.
    pub(super) fn order(
        &mut self,
        (waited, is_alone): (Duration, bool),
        now: Duration,
        target: Duration,
    ) -> Order {
        // During overload refusals make room, so a short wait says nothing unless the request is alone.
        let is_short = waited <= target && (is_alone || !self.is_overloaded);
        if now < self.until {
            self.is_long &= !is_short;
        } else {
            // An interval that ended long ago does not count.
            let is_recent = now < self.until + INTERVAL;
            self.is_overloaded = is_recent && (self.is_long || self.has_refused);
            (self.until, self.is_long) = (now + INTERVAL, !is_short);
            self.has_refused = false;
        }
        // Refusing the only request would let no newer one be answered in its place.
        let is_refused = self.is_overloaded && waited > 2 * target && !is_alone;
        self.has_refused |= is_refused;
        match self.is_overloaded {
            false => Order::Oldest,
            true if is_refused => Order::Refuse,
            true => Order::Newest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: Duration = Duration::from_millis(75);
    const LATE: Duration = Duration::from_millis(160);

    /// The order every ten milliseconds, while the oldest request has waited for `waited` each time: it must be the
    /// same all the time.
    fn order(delay: &mut ControlledDelay, from: u64, to: u64, waited: Duration) -> Order {
        let mut moments = (from..to).step_by(10).map(Duration::from_millis);
        let mut order = || Some(delay.order((waited, waited.is_zero()), moments.next()?, TARGET));
        let first = order().expect("a moment");
        while let Some(other) = order() {
            assert_eq!(other, first);
        }
        first
    }

    #[test]
    fn a_burst_is_worked_off_and_a_queue_that_stays_is_cut() {
        let mut delay = ControlledDelay::default();
        assert_eq!(order(&mut delay, 10_000, 10_490, LATE), Order::Oldest);
        // The queue was short once in the interval.
        assert_eq!(order(&mut delay, 10_490, 10_500, TARGET), Order::Oldest);
        assert_eq!(order(&mut delay, 10_500, 11_000, LATE), Order::Oldest);
        assert_eq!(order(&mut delay, 11_000, 11_500, LATE), Order::Refuse);
        assert_eq!(order(&mut delay, 11_500, 12_000, 2 * TARGET), Order::Newest);
        // Short waits that come from refusals do not end the overload.
        assert_eq!(order(&mut delay, 12_000, 14_000, TARGET), Order::Newest);
    }

    /// A case of the simulation: `attack --only random_clients --seed 2`.
    #[test]
    fn the_only_request_of_a_client_is_late_and_not_refused() {
        let mut delay = ControlledDelay::default();
        let mut orders = (0..30).map(|frame| {
            let now = Duration::from_millis(10_000 + 100 * frame);
            delay.order((LATE, true), now, TARGET)
        });
        assert!(orders.all(|order| order != Order::Refuse));
    }

    #[test]
    fn it_ends_once_the_queue_is_short_or_was_empty() {
        let mut delay = ControlledDelay::default();
        order(&mut delay, 0, 500, LATE);
        assert_eq!(order(&mut delay, 500, 990, LATE), Order::Refuse);
        let mut after_a_pause = delay;
        assert_eq!(order(&mut after_a_pause, 5_000, 5_500, LATE), Order::Oldest);
        // The queue was empty because others were refused.
        assert_eq!(order(&mut delay, 990, 1_000, Duration::ZERO), Order::Newest);
        assert_eq!(order(&mut delay, 1_000, 1_490, TARGET), Order::Newest);
        assert_eq!(
            order(&mut delay, 1_490, 1_500, Duration::ZERO),
            Order::Newest
        );
        assert_eq!(order(&mut delay, 1_500, 2_000, LATE), Order::Oldest);
    }
}
