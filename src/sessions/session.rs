//! One session: a tracker behind a lock that is taken in order of arrival.
//!
//! A request first takes one of a few places at the session ([`Session::enter`]), then the lock
//! ([`Place::lock`]), and moves the [`Locked`] session into the blocking work. The lock is fair, so
//! requests are served in the order in which they asked for it.

use super::clock::Clock;
use super::envelope::{self, EnvelopeError};
use super::replay::{self, Answered, Fingerprint, ReplayError, Turn};
use crate::tracker::{Estimate, GrayFrame, Params, Rect, Tracker, TrackerError};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::{Mutex as AsyncMutex, OwnedMutexGuard, OwnedSemaphorePermit, Semaphore};
use uuid::Uuid;

/// A frame that took no longer than this is brief work.
const BRIEF: Duration = Duration::from_millis(4);

/// All places at the session are taken; try again later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("too many requests wait for the session")]
pub struct Busy;

/// The session was ended while the request waited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the session has ended")]
pub struct Closed;

/// The part of a session that work changes.
#[derive(Debug)]
pub struct State {
    tracker: Tracker,
    /// The frames of the last post, oldest first; never empty.
    recent: Vec<Answered>,
}

impl State {
    /// A session that starts with `tracker`, made from the frame with this digest and this box.
    pub fn new(tracker: Tracker, fingerprint: Fingerprint, given: Rect) -> Self {
        let first = Answered {
            fingerprint,
            given: Some(given),
            estimate: tracker.estimate(),
        };
        Self {
            tracker,
            recent: vec![first],
        }
    }

    /// The session that a snapshot holds.
    ///
    /// # Errors
    /// See [`EnvelopeError`].
    pub fn restore(snapshot: &[u8]) -> Result<Self, EnvelopeError> {
        let (tracker, recent) = envelope::open(snapshot)?;
        Ok(Self { tracker, recent })
    }

    /// The session as bytes.
    pub fn snapshot(&self) -> Vec<u8> {
        envelope::seal(&self.tracker, &self.recent)
    }

    /// Whether a post, whose (first) frame the client calls `number`, is the next one or was answered before. `given` is
    /// the box, where the post corrects it. Without a number every post is the next one; with one, a post that ends with
    /// the last frame and holds nothing but frames of the last post, with the same bytes and box, is a replay.
    ///
    /// # Errors
    /// The frame number does not fit.
    pub fn turn(
        &self,
        number: Option<u64>,
        posted: &[Fingerprint],
        given: Option<Rect>,
    ) -> Result<Turn, ReplayError> {
        replay::judge(&self.recent, number, posted, given)
    }

    /// Tracks through `frames` in order: all of them, or none.
    ///
    /// # Errors
    /// The index of the frame that the tracker refused, and why. The session is unchanged.
    pub fn step(
        &mut self,
        frames: &[(Fingerprint, GrayFrame)],
    ) -> Result<Vec<Estimate>, (usize, TrackerError)> {
        // A refused frame leaves the tracker unchanged; only an earlier one of the same post can have moved it.
        let before = (frames.len() > 1).then(|| self.tracker.clone());
        let mut answered = Vec::with_capacity(frames.len());
        for (index, (fingerprint, frame)) in frames.iter().enumerate() {
            match self.tracker.step(frame) {
                Ok(estimate) => answered.push(Answered {
                    fingerprint: *fingerprint,
                    given: None,
                    estimate,
                }),
                Err(error) => {
                    if let Some(before) = before {
                        self.tracker = before;
                    }
                    return Err((index, error));
                }
            }
        }
        let estimates = answered.iter().map(|answered| answered.estimate).collect();
        if !answered.is_empty() {
            self.recent = answered;
        }
        Ok(estimates)
    }

    /// The user corrects the box, with the next frame.
    ///
    /// # Errors
    /// The tracker refused the frame or the box. The session is unchanged.
    pub fn retarget(
        &mut self,
        fingerprint: Fingerprint,
        frame: &GrayFrame,
        given: Rect,
    ) -> Result<Estimate, TrackerError> {
        let estimate = self.tracker.retarget(frame, given)?;
        self.recent = vec![Answered {
            fingerprint,
            given: Some(given),
            estimate,
        }];
        Ok(estimate)
    }
}

/// One session.
#[derive(Debug)]
pub struct Session {
    id: Uuid,
    source_size: (u32, u32),
    params: Params,
    state: Arc<AsyncMutex<State>>,
    /// Requests that may be at this session at once, the one at work included.
    places: Arc<Semaphore>,
    max_places: usize,
    /// The last answer, to be read without waiting for the lock.
    latest: Mutex<Estimate>,
    clock: Clock,
    last_used_ms: AtomicU64,
    /// Whether the last frame took little time; not known before there was one.
    brief: AtomicBool,
    closed: AtomicBool,
}

impl Session {
    pub(super) fn new(state: State, max_places: usize, clock: Clock) -> Arc<Self> {
        let session = Self {
            id: Uuid::new_v4(),
            source_size: state.tracker.source_size(),
            params: state.tracker.params().clone(),
            latest: Mutex::new(state.tracker.estimate()),
            state: Arc::new(AsyncMutex::new(state)),
            places: Arc::new(Semaphore::new(max_places)),
            max_places,
            clock,
            last_used_ms: AtomicU64::new(0),
            brief: AtomicBool::new(false),
            closed: AtomicBool::new(false),
        };
        session.touch();
        Arc::new(session)
    }

    /// The session's id.
    pub fn id(&self) -> Uuid {
        self.id
    }

    /// Width and height of the session's frames as uploaded.
    pub fn source_size(&self) -> (u32, u32) {
        self.source_size
    }

    /// The tracker's parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The last answer.
    pub fn latest(&self) -> Estimate {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// When the session was last used, by its clock.
    pub fn last_used(&self) -> Duration {
        Duration::from_millis(self.last_used_ms.load(Ordering::Relaxed))
    }

    /// Counts as use: the session expires an idle time from now.
    pub fn touch(&self) {
        let now = u64::try_from(self.clock.now().as_millis()).unwrap_or(u64::MAX);
        self.last_used_ms.fetch_max(now, Ordering::Relaxed);
    }

    /// Tells how long the work of the last frame took.
    pub fn took(&self, time: Duration) {
        self.brief.store(time <= BRIEF, Ordering::Relaxed);
    }

    /// Whether the next frame, if it is like the last one, takes a few milliseconds at most.
    pub fn is_brief(&self) -> bool {
        self.brief.load(Ordering::Relaxed)
    }

    /// Whether a request is at the session.
    pub fn is_busy(&self) -> bool {
        self.places.available_permits() < self.max_places
    }

    /// Whether the session has ended.
    pub fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Acquire)
    }

    pub(super) fn close(&self) {
        self.closed.store(true, Ordering::Release);
    }

    /// Takes a place at the session.
    ///
    /// # Errors
    /// All places are taken.
    pub fn enter(self: &Arc<Self>) -> Result<Place, Busy> {
        let permit = self.places.clone().try_acquire_owned().map_err(|_| Busy)?;
        self.touch();
        Ok(Place {
            session: self.clone(),
            _permit: permit,
        })
    }
}

/// A place at a session: it cannot expire while one is taken.
#[derive(Debug)]
pub struct Place {
    session: Arc<Session>,
    _permit: OwnedSemaphorePermit,
}

impl Place {
    /// The session.
    pub fn session(&self) -> &Arc<Session> {
        &self.session
    }

    /// Waits for the session, in order of arrival.
    ///
    /// # Errors
    /// The session was ended in the meantime.
    pub async fn lock(self) -> Result<Locked, Closed> {
        let state = self.session.state.clone().lock_owned().await;
        if self.session.is_closed() {
            return Err(Closed);
        }
        Ok(Locked { state, place: self })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.session.touch();
    }
}

/// A session whose state is this request's alone.
#[derive(Debug)]
pub struct Locked {
    state: OwnedMutexGuard<State>,
    place: Place,
}

impl Locked {
    /// The session.
    pub fn session(&self) -> &Arc<Session> {
        self.place.session()
    }

    /// The state.
    pub fn state(&mut self) -> &mut State {
        &mut self.state
    }
}

impl Drop for Locked {
    fn drop(&mut self) {
        let session = self.place.session();
        if std::thread::panicking() {
            // A tracker that panicked half-way through a frame cannot be trusted with the next one.
            session.close();
            return;
        }
        let latest = self.state.tracker.estimate();
        *session
            .latest
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = latest;
    }
}
