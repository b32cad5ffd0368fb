//! Why an act was not done. An act that fails leaves the session's state unchanged.

use crate::store::StoreShare;
use crate::{
    InsertError, NoSession, QueueFull, ReplayError, SessionBusy, SessionClosed, SnapshotError,
    StartError, Stopped, StoreUnavailable, TooManySessions, WorkPanicked,
};
use bagtrack_ingest::IngestError;
use bagtrack_tracker::{ImplausibleBox, TrackerError};

/// Why an act was not done, whatever it was about.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ActError {
    /// There is no session.
    #[error(transparent)]
    NoSession(#[from] NoSession),
    /// Too many requests are at the session.
    #[error(transparent)]
    Busy(#[from] SessionBusy),
    /// The queue before the workers is full.
    #[error(transparent)]
    QueueFull(#[from] QueueFull),
    /// The store gives no answer.
    #[error(transparent)]
    Store(#[from] StoreUnavailable),
    /// The work was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The work panicked.
    #[error(transparent)]
    Panicked(#[from] WorkPanicked),
    /// There is no room for one more session in memory.
    #[error(transparent)]
    TooManySessions(#[from] TooManySessions),
    /// The state that the store has cannot be read.
    #[error("the stored state cannot be read: {0}")]
    StoredState(SnapshotError),
}

impl From<SessionClosed> for ActError {
    fn from(_: SessionClosed) -> Self {
        Self::NoSession(NoSession::Unknown)
    }
}

impl ActError {
    /// Whether the same request may succeed soon: the service was busy or away, or the time was too short.
    pub fn is_temporary(&self) -> bool {
        match self {
            Self::Busy(_) | Self::QueueFull(_) | Self::Store(_) | Self::TooManySessions(_) => true,
            Self::Stopped(stopped) => !matches!(stopped, Stopped::Cost(_)),
            Self::NoSession(_) | Self::Panicked(_) | Self::StoredState(_) => false,
        }
    }
}

/// Why one frame cannot be tracked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrameFault {
    /// The file cannot be decoded.
    #[error(transparent)]
    Ingest(#[from] IngestError),
    /// The tracker refuses the frame.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
}

/// Why none of a request's frames was tracked.
#[derive(Debug, Clone, thiserror::Error)]
pub enum FramesError {
    /// See [`ActError`].
    #[error(transparent)]
    Act(#[from] ActError),
    /// The frame number is out of order, or was used for another frame.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The frames have no numbers, and another request with frames was at the session.
    #[error("another request with frames was at the session")]
    NotInOrder,
    /// A newer stream of the session has replaced the stream of these frames.
    #[error("a newer stream has taken the place of this one")]
    StreamReplaced,
    /// A corrected box names no target where the session has several, or a target that does not exist.
    #[error("the session has {count} targets")]
    NoSuchTarget {
        /// How many there are.
        count: usize,
    },
    /// One of the frames cannot be tracked.
    #[error("frame {index} of {count}: {fault}")]
    Frame {
        /// Which one, counted from 0.
        index: usize,
        /// How many there are.
        count: usize,
        /// Why.
        fault: FrameFault,
    },
    /// The corrected box is implausible.
    #[error(transparent)]
    Box(#[from] ImplausibleBox),
    /// The frames have too many pixels together.
    #[error("the frames have {pixels} pixels together, over {limit}")]
    TooManyPixels {
        /// How many they have.
        pixels: u64,
        /// How many they may have.
        limit: u64,
    },
}

impl FramesError {
    /// See [`ActError::is_temporary`].
    pub fn is_temporary(&self) -> bool {
        match self {
            Self::Act(error) => error.is_temporary(),
            Self::StreamReplaced => true,
            _ => false,
        }
    }
}

/// The fault of a request's only frame.
impl From<FrameFault> for FramesError {
    fn from(fault: FrameFault) -> Self {
        Self::Frame {
            index: 0,
            count: 1,
            fault,
        }
    }
}

/// A client has as many sessions, requests or streams as it may, or its sessions are as large as they may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the client has as many {what} as it may, {limit}")]
pub struct QuotaExhausted {
    /// The things of which the client has too many, such as "sessions".
    pub what: &'static str,
    /// How many the client may have.
    pub limit: usize,
}

/// Why no session was opened.
#[derive(Debug, Clone, thiserror::Error)]
pub enum OpenError {
    /// See [`ActError`].
    #[error(transparent)]
    Act(#[from] ActError),
    /// The first frame cannot be used.
    #[error(transparent)]
    Frame(#[from] FramesError),
    /// The tracker refuses a box or a parameter.
    #[error("{error}")]
    Start {
        /// Why.
        error: StartError,
        /// How many boxes were given, where they were given as a list.
        listed: Option<usize>,
    },
    /// A box is implausible.
    #[error("{error}")]
    Box {
        /// Why.
        error: ImplausibleBox,
        /// The box's index, from 0, and the number of boxes, where they were given as a list.
        listed: Option<(usize, usize)>,
    },
    /// The snapshot cannot be restored.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The service is about to end.
    #[error("the service is about to end")]
    Draining,
    /// The client has as many sessions as it may.
    #[error(transparent)]
    Quota(#[from] QuotaExhausted),
    /// The client has used up its share of the store.
    #[error("the client has {} places of sessions in the store, or {} bytes of them", .0.max_places, .0.max_bytes)]
    StoreShare(StoreShare),
    /// The client may never have a session with so many targets: each counts as a session.
    #[error("{count} targets are more than the {limit} sessions that the client may have")]
    TooManyTargets {
        /// How many there are.
        count: usize,
        /// How many sessions the client may have.
        limit: usize,
    },
    /// Another request has opened a session with this id.
    #[error("another session has this id")]
    Exists,
    /// The idempotency key was used for another request.
    #[error("the idempotency key was used for another request")]
    KeyReused,
}

impl From<InsertError> for OpenError {
    fn from(error: InsertError) -> Self {
        match error {
            InsertError::Full(full) => Self::Act(full.into()),
            InsertError::Taken => Self::Exists,
        }
    }
}

/// Why nothing was tracked without a session.
#[derive(Debug, Clone, thiserror::Error)]
pub enum TrackError {
    /// The frames cannot be tracked.
    #[error(transparent)]
    Frames(#[from] FramesError),
    /// The track cannot begin.
    #[error(transparent)]
    Open(#[from] OpenError),
}

macro_rules! through {
    ($from:ty => $through:ident in $to:ty) => {
        impl From<$from> for $to {
            fn from(error: $from) -> Self {
                Self::$through(error.into())
            }
        }
    };
}

through!(Stopped => Act in FramesError);
through!(StoreUnavailable => Act in FramesError);
through!(SessionBusy => Act in FramesError);
through!(SessionClosed => Act in FramesError);
through!(QueueFull => Act in FramesError);
through!(Stopped => Act in OpenError);
through!(StoreUnavailable => Act in OpenError);
through!(TooManySessions => Act in OpenError);
through!(ActError => Frames in TrackError);
