//! How fast a client may send: the configured rate of frames, and fixed rates for messages, requests and handshakes,
//! which take time of the network threads.

use bagtrack_sessions::clock::{self, Instant};
use governor::clock::{Clock, DefaultClock};
use governor::middleware::StateInformationMiddleware;
use governor::state::{InMemoryState, NotKeyed};
use governor::{DefaultDirectRateLimiter, NotUntil, Quota, RateLimiter};
use std::num::NonZeroU32;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// A rate: how many a second, and the burst, which is how many at once.
pub type Rate = (NonZeroU32, NonZeroU32);

/// Frames of WebSockets, which carry messages: as many as some hundred cameras send, and so few that they take a
/// network thread little time, whatever is in them.
pub const MESSAGES: Rate = rate(10_000, 2_000);
/// Requests that take no turn at the workers: more than the pages and programs of a few people send, and so few that
/// they take a few percent of a network thread's time. The burst is the page's 70 files for a dozen people behind one
/// address.
pub const ASKED: Rate = rate(500, 1_000);
/// TLS handshakes: in each the service signs, which takes a network thread milliseconds with a large RSA key. The burst
/// is enough for the cameras and pages of some dozen people behind one address.
pub const HANDSHAKES: Rate = rate(25, 64);

/// A client has sent too many of something lately.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the client may send {limit} {what}")]
pub struct RateExceeded {
    /// What the client has sent too many of.
    pub what: &'static str,
    /// How many it may send, in the unit of `what`.
    pub limit: usize,
    /// After how long it may send again.
    pub wait: Duration,
}

/// How many frames a client may send.
#[derive(Debug)]
pub struct FrameRate {
    rate: Rate,
    limiter: RateLimiter<NotKeyed, InMemoryState, DefaultClock, StateInformationMiddleware>,
    /// How many frames were left at the last count, and the moment of that count.
    left: Mutex<(u32, Instant)>,
}

impl FrameRate {
    /// A frame rate whose whole burst is left.
    pub fn new(rate: Rate) -> Self {
        Self {
            rate,
            limiter: RateLimiter::direct(quota(rate)).with_middleware(),
            left: Mutex::new((rate.1.get(), clock::now())),
        }
    }

    /// Counts frames.
    ///
    /// # Errors
    /// Too many were counted lately.
    pub fn count(&self, frames: NonZeroU32) -> Result<(), RateExceeded> {
        match self.limiter.check_n(frames) {
            Ok(Ok(state)) => {
                self.note_left(state.remaining_burst_capacity());
                Ok(())
            }
            Ok(Err(not_yet)) => {
                self.note_left(0);
                Err(exceeded("frames a second", self.rate, &not_yet))
            }
            // More frames than the burst, which no request has.
            Err(_) => Ok(()),
        }
    }

    /// How many frames may be sent now: those left at the last count, and those that the rate has allowed since.
    pub fn left(&self) -> u32 {
        let (rate, burst) = self.rate;
        let noted = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let (left, at) = *noted;
        let back = at.elapsed().as_secs_f64() * f64::from(rate.get());
        // The cast saturates.
        left.saturating_add(back as u32).min(burst.get())
    }

    fn note_left(&self, left: u32) {
        // Nothing panics while the lock is held.
        let mut noted = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        *noted = (left, clock::now());
    }
}

/// Counts one event at a limiter of this rate; `what` names the events in the error.
///
/// # Errors
/// Too many were counted lately.
pub fn count_one(
    limiter: &DefaultDirectRateLimiter,
    what: &'static str,
    rate: Rate,
) -> Result<(), RateExceeded> {
    let counted = limiter.check();
    counted.map_err(|not_yet| exceeded(what, rate, &not_yet))
}

/// A limiter that has counted nothing.
pub fn limiter(rate: Rate) -> DefaultDirectRateLimiter {
    RateLimiter::direct(quota(rate))
}

const fn rate(a_second: u32, at_once: u32) -> Rate {
    let is_positive = "it is not 0";
    (
        NonZeroU32::new(a_second).expect(is_positive),
        NonZeroU32::new(at_once).expect(is_positive),
    )
}

fn quota((a_second, at_once): Rate) -> Quota {
    Quota::per_second(a_second).allow_burst(at_once)
}

fn exceeded(
    what: &'static str,
    (a_second, _): Rate,
    not_yet: &NotUntil<<DefaultClock as Clock>::Instant>,
) -> RateExceeded {
    RateExceeded {
        what,
        limit: usize::try_from(a_second.get()).unwrap_or(usize::MAX),
        wait: not_yet.wait_time_from(DefaultClock::default().now()),
    }
}
