//! The problems that the errors of the other modules become.

use super::problem::{Effect, Problem};
use bagtrack_api::ProblemKind as Kind;
use bagtrack_ingest::IngestError;
use bagtrack_quotas::RateExceeded;
use bagtrack_sessions::{
    ActError, BudgetFull, FrameFault, FramesError, NoSession, OpenError, QueueFull, QuotaExhausted,
    ReplayError, SessionBusy, SnapshotError, StartError, Stopped, StoreUnavailable,
    TooManySessions, TrackError, WorkPanicked,
};
use bagtrack_tracker::{ImplausibleBox, TrackerError};
use std::sync::Arc;
use std::time::Duration;

impl From<ReplayError> for Problem {
    fn from(error: ReplayError) -> Self {
        match error {
            ReplayError::OutOfOrder { got, expected } => {
                let detail =
                    format!("This session expects frame {expected}, and frame {got} was sent.");
                Self::new(Kind::FrameOutOfOrder, detail).expecting_frame(expected)
            }
            ReplayError::Differs { got, expected } => {
                let detail = format!(
                    "Frame {got} was answered for other bytes or another box; a new frame has the number {expected}."
                );
                Self::new(Kind::FrameDiffers, detail).expecting_frame(expected)
            }
        }
    }
}

impl From<IngestError> for Problem {
    fn from(error: IngestError) -> Self {
        match error {
            IngestError::UnknownFormat => {
                let detail = "The type is taken from the bytes; send a JPEG, PNG or WebP image.";
                Self::new(Kind::UnsupportedImage, detail)
            }
            IngestError::UnreadFormat(name) => Self::new(Kind::UnsupportedImage, unread(name)),
            IngestError::TooLarge(limit) => Self::new(
                Kind::FrameTooLarge,
                format!("{limit}. Send a smaller frame."),
            ),
            damaged => {
                let detail = format!("{damaged}. Send the whole file again.");
                Self::new(Kind::FrameDamaged, detail)
            }
        }
    }
}

/// The detail of the problem for a file of a known type that is not read.
fn unread(name: &str) -> String {
    let cure = match name {
        "HEIC" | "HEIF" => "On an iPhone: Settings, Camera, Formats, Most Compatible.",
        "AVI" | "FLV" | "WMV" | "MPEG" | "MPEG-TS" | "MXF" | "Ogg" | "IVF" | "Y4M"
        | "raw H.264" | "raw H.265" => {
            "Of videos send MP4, WebM or GIF: `ffmpeg -i VIDEO clip.mp4` makes one."
        }
        "text" => {
            "With curl the name of a file has an `@` before it: `--data-binary @file`, `-F frame=@file`."
        }
        "base64" => {
            "Send the bytes of the file itself (`curl --data-binary @file`), or base64 in the field `frame` of JSON."
        }
        "gzip" | "ZIP" => "Send the file itself, not packed.",
        _ => "Convert it, or let the camera or the browser make JPEGs.",
    };
    format!("The file has the format {name}, which is not read. Send JPEG, PNG or WebP. {cure}")
}

impl From<TrackerError> for Problem {
    fn from(error: TrackerError) -> Self {
        match error {
            TrackerError::Params(error) => Self::invalid_parameter(error.to_string()),
            TrackerError::Target(_) => Self::new(Kind::InvalidBox, format!("{error}.")),
            TrackerError::FrameSize { .. } => {
                let detail = format!("{error}. Open a new session for frames of another size.");
                Self::new(Kind::FrameSizeMismatch, detail)
            }
            other => Self::internal(Arc::new(other)),
        }
    }
}

impl From<ImplausibleBox> for Problem {
    fn from(error: ImplausibleBox) -> Self {
        Self::new(Kind::InvalidBox, format!("{error}."))
    }
}

impl From<StartError> for Problem {
    fn from(error: StartError) -> Self {
        match error {
            StartError::Refused { error, .. } => error.into(),
            StartError::TooLarge { .. } => {
                let detail = format!("{error}. Send fewer boxes, or parameters that keep less.");
                Self::invalid_parameter(detail)
            }
            StartError::Stopped(stopped) => stopped.into(),
        }
    }
}

impl From<SnapshotError> for Problem {
    fn from(error: SnapshotError) -> Self {
        let advice = "Send the bytes of GET /sessions/{id}/snapshot unchanged, to a service with the same keys.";
        let detail = match &error {
            // The snapshot is intact: it is this service that cannot go on from it.
            SnapshotError::Tracker(TrackerError::Expert(reason)) => format!("{reason}."),
            error => format!("{error}. {advice}"),
        };
        Self::new(Kind::InvalidSnapshot, detail).caused_by(Arc::new(error))
    }
}

impl From<QueueFull> for Problem {
    fn from(_: QueueFull) -> Self {
        let detail = "Try again after the time in `Retry-After`.";
        Self::new(Kind::QueueFull, detail).with_effect(Effect::NothingChanged)
    }
}

impl From<BudgetFull> for Problem {
    fn from(full: BudgetFull) -> Self {
        match full {
            BudgetFull::All => QueueFull.into(),
            BudgetFull::Client => {
                let detail = "The bodies of this client's requests take as much memory as one client's may. Try again \
                    after the time in `Retry-After`.";
                Self::new(Kind::QuotaExceeded, detail).with_effect(Effect::NothingChanged)
            }
        }
    }
}

impl From<TooManySessions> for Problem {
    fn from(_: TooManySessions) -> Self {
        let detail =
            "Delete sessions that have ended, or try again after the time in `Retry-After`.";
        Self::new(Kind::TooManySessions, detail)
    }
}

impl From<Stopped> for Problem {
    fn from(stopped: Stopped) -> Self {
        match stopped {
            Stopped::Cost(limit) => {
                let detail = format!(
                    "The frames of this request took more than {limit:?} of processor time. Send fewer or smaller \
                     frames in a request."
                );
                Self::new(Kind::RequestTooCostly, detail).with_effect(Effect::NoFrameTracked)
            }
            Stopped::Overload => {
                let detail = "More frames of this client come than are done, and they wait too long for a worker. Send \
                    fewer at a time, or try again after the time in `Retry-After`.";
                Self::new(Kind::QueueFull, detail).with_effect(Effect::NothingChanged)
            }
            // Nobody reads the answer to work that was abandoned.
            Stopped::Deadline | Stopped::Abandoned => Self::work_timeout(),
        }
    }
}

impl From<SessionBusy> for Problem {
    fn from(_: SessionBusy) -> Self {
        let detail = "Wait for the answers to the frames already sent.";
        Self::new(Kind::SessionBusy, detail).with_effect(Effect::SessionUnchanged)
    }
}

impl From<NoSession> for Problem {
    fn from(error: NoSession) -> Self {
        match error {
            NoSession::Unknown => Self::session_not_found(),
            NoSession::Expired => Self::session_expired(),
            NoSession::Lost => Self::session_lost(),
        }
    }
}

impl From<StoreUnavailable> for Problem {
    fn from(away: StoreUnavailable) -> Self {
        let detail = "Send the request again after the time in `Retry-After`. A frame is not counted; sent with its number \
            (`?frame=N`) it is never tracked twice.";
        Self::new(Kind::StoreUnavailable, detail).caused_by(Arc::new(away))
    }
}

impl From<WorkPanicked> for Problem {
    fn from(error: WorkPanicked) -> Self {
        Self::internal(Arc::new(error))
    }
}

impl From<QuotaExhausted> for Problem {
    fn from(QuotaExhausted { what, limit }: QuotaExhausted) -> Self {
        let detail = format!(
            "One client may have {limit} {what} here. Try again after the time in `Retry-After`."
        );
        Self::new(Kind::QuotaExceeded, detail).with_effect(Effect::NothingChanged)
    }
}

impl From<RateExceeded> for Problem {
    fn from(RateExceeded { what, limit, wait }: RateExceeded) -> Self {
        Self::from(QuotaExhausted { what, limit }).retry_after(wait)
    }
}

impl From<ActError> for Problem {
    fn from(error: ActError) -> Self {
        match error {
            ActError::NoSession(error) => error.into(),
            ActError::Busy(error) => error.into(),
            ActError::QueueFull(error) => error.into(),
            ActError::Store(error) => error.into(),
            ActError::Stopped(error) => error.into(),
            ActError::Panicked(error) => error.into(),
            ActError::TooManySessions(error) => error.into(),
            ActError::StoredState(SnapshotError::Tracker(TrackerError::Expert(reason))) => {
                let detail = format!("This replica cannot go on with the session: {reason}.");
                Self::new(Kind::StoreUnavailable, detail)
            }
            // Another version of the program has written the state.
            ActError::StoredState(
                error @ (SnapshotError::Version(_) | SnapshotError::Tracker(_)),
            ) => {
                let detail = format!("This replica cannot read the session's state: {error}.");
                Self::new(Kind::StoreUnavailable, detail)
            }
            ActError::StoredState(error) => Self::internal(Arc::new(error)),
        }
    }
}

impl From<FrameFault> for Problem {
    fn from(fault: FrameFault) -> Self {
        match fault {
            FrameFault::Ingest(error) => error.into(),
            FrameFault::Tracker(error) => error.into(),
        }
    }
}

impl From<FramesError> for Problem {
    fn from(error: FramesError) -> Self {
        match error {
            FramesError::Act(error) => error.into(),
            FramesError::Replay(error) => error.into(),
            FramesError::NotInOrder => Self::not_in_order(),
            FramesError::StreamReplaced => Self::work_timeout(),
            FramesError::NoSuchTarget { count } => Self::which_target(count),
            FramesError::Frame {
                index,
                count,
                fault,
            } => Self::from(fault).of_frame(index, count),
            FramesError::Box(error) => error.into(),
            FramesError::TooManyPixels { pixels, limit } => Self::too_many_pixels(pixels, limit),
        }
    }
}

impl Problem {
    /// The client has as many sessions as it may.
    fn no_more_sessions(most: &str) -> Self {
        let detail = format!(
            "One client may have {most}. Delete sessions that are done, or try again after the time in `Retry-After`."
        );
        // A session stays for longer than a request, so trying again at once is no use.
        Self::new(Kind::QuotaExceeded, detail)
            .with_effect(Effect::NothingChanged)
            .retry_after(Duration::from_secs(10))
    }
}

impl From<OpenError> for Problem {
    fn from(error: OpenError) -> Self {
        match error {
            OpenError::Act(error) => error.into(),
            OpenError::Frame(error) => error.into(),
            OpenError::Start { error, listed } => match (&error, listed) {
                (&StartError::Refused { target, .. }, Some(count)) => {
                    Self::from(error).of_target(target, count)
                }
                _ => error.into(),
            },
            OpenError::Box { error, listed } => match listed {
                Some((target, count)) => Self::from(error).of_target(target, count),
                None => error.into(),
            },
            OpenError::Snapshot(error) => error.into(),
            OpenError::Draining => Self::not_ready(),
            OpenError::Quota(QuotaExhausted { what, limit }) => {
                Self::no_more_sessions(&format!("{limit} {what} here"))
            }
            OpenError::StoreShare(share) => Self::no_more_sessions(&format!(
                "{} sessions in the store here, and {} bytes of them (a quarter of `--max-session-bytes`)",
                share.max_places, share.max_bytes
            )),
            OpenError::TooManyTargets { count, limit } => Self::invalid_parameter(format!(
                "Each target counts as a session, and one client may have {limit} here (`--client-sessions`): \
                 of {count} targets follow at most {limit}."
            )),
            OpenError::Exists => Self::session_exists(),
            OpenError::KeyReused => Self::idempotency_key_reused(),
        }
    }
}

impl From<TrackError> for Problem {
    fn from(error: TrackError) -> Self {
        match error {
            TrackError::Frames(error) => error.into(),
            TrackError::Open(error) => error.into(),
        }
    }
}
