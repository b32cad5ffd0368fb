//! The time by which what is in a folder expires.
//!
//! The folder's time passes as the monotonic clock does, so that no session ends because the wall clock is set. (A
//! small board without a battery sets it soon after each start.) The folder keeps how far the wall clock is ahead of
//! the folder's time. After a restart the folder's time follows from the wall clock and this difference, so the time in
//! between counts.

use crate::clock::Clock;
use std::time::Duration;

/// The name of the note that keeps a [`Noted`].
pub(super) const CLOCK: &str = "clock";
/// Where the wall clock departs from the monotonic one by this many milliseconds, it was set, or the machine was
/// suspended.
const SET_MS: i64 = 1000;
/// The time is noted at least once in this many milliseconds.
const NOTED_MS: u64 = 60_000;

/// What a folder keeps of its time, in milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Noted {
    /// How far the wall clock is ahead of the folder's time.
    ahead: i64,
    /// The folder's time. It never goes back, even where the wall clock begins in 1970 at each start.
    now: u64,
}

impl Noted {
    pub(super) fn to_bytes(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        bytes[..8].copy_from_slice(&self.ahead.to_be_bytes());
        bytes[8..].copy_from_slice(&self.now.to_be_bytes());
        bytes
    }

    pub(super) fn from_bytes(bytes: [u8; 16]) -> Self {
        let (ahead, now) = bytes.split_at(8);
        Self {
            ahead: i64::from_be_bytes(ahead.try_into().expect("it has 8 bytes")),
            now: u64::from_be_bytes(now.try_into().expect("it has 8 bytes")),
        }
    }
}

/// The time of a folder, in milliseconds: since 1970, where the wall clock was never set.
pub(super) struct Time {
    clock: Clock,
    /// The folder's time at the clock's beginning.
    start: i64,
    noted: Noted,
}

impl Time {
    /// Goes on from what a folder has noted.
    pub(super) fn new(clock: Clock, noted: Noted) -> Self {
        let last = i64::try_from(noted.now).unwrap_or(i64::MAX);
        let now = wall(&clock).saturating_sub(noted.ahead).max(last);
        let start = now.saturating_sub(passed(&clock));
        Self {
            clock,
            start,
            noted,
        }
    }

    pub(super) fn now(&self) -> u64 {
        u64::try_from(self.start.saturating_add(passed(&self.clock))).unwrap_or(0)
    }

    /// The note that is due, where the wall clock was set or the last note is old.
    pub(super) fn due(&self) -> Option<Noted> {
        let (now, last) = (self.now(), self.noted);
        let ahead = wall(&self.clock).saturating_sub_unsigned(now);
        let is_set = ahead.saturating_sub(last.ahead).saturating_abs() >= SET_MS;
        let is_old = now.saturating_sub(last.now) >= NOTED_MS;
        (is_set || is_old).then_some(Noted { ahead, now })
    }

    /// Remembers what was noted last.
    pub(super) fn note(&mut self, noted: Noted) {
        self.noted = noted;
    }
}

/// Milliseconds since 1970 by the wall clock.
fn wall(clock: &Clock) -> i64 {
    milliseconds(clock.since_1970(clock.now()))
}

/// Milliseconds since the clock's beginning.
fn passed(clock: &Clock) -> i64 {
    milliseconds(clock.now())
}

fn milliseconds(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}
