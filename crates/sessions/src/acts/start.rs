//! What a session begins with.

use super::error::{FrameFault, FramesError, OpenError};
use super::service::SessionService;
use crate::{Boxes, Fingerprint, PerTarget, SessionState, StartError, WorkMeter, frame_format};
use bagtrack_tracker::{Params, check_box};
use bytes::Bytes;

/// What a session begins with.
#[derive(Debug)]
pub enum Start {
    /// A first frame, and the targets in it.
    Frame {
        /// The file.
        file: Bytes,
        /// The targets' boxes.
        boxes: Boxes,
        /// The trackers' parameters; the seed is that of the first target's tracker.
        params: Box<Params>,
    },
    /// A signed snapshot.
    Snapshot(Bytes),
}

impl Start {
    /// How many targets the session will have; 1 for a snapshot, which is not read yet.
    pub(super) fn target_count(&self) -> usize {
        match self {
            Self::Frame { boxes, .. } => boxes.as_slice().len(),
            Self::Snapshot(_) => 1,
        }
    }

    pub(super) fn file_bytes(&self) -> usize {
        match self {
            Self::Frame { file, .. } | Self::Snapshot(file) => file.len(),
        }
    }

    /// The state of a session that begins with this.
    ///
    /// # Errors
    /// The frame, a box, a parameter or the snapshot cannot be used, or the work was stopped.
    pub(super) fn run(
        &self,
        service: &SessionService,
        meter: &mut WorkMeter,
    ) -> Result<SessionState, OpenError> {
        let expert = service.expert.as_ref();
        let (file, boxes, params) = match self {
            Self::Snapshot(bytes) => {
                let max_recent = service.settings.max_answers;
                return Ok(SessionState::restore(
                    bytes,
                    &service.keys,
                    max_recent,
                    expert,
                )?);
            }
            Self::Frame {
                file,
                boxes,
                params,
            } => (file, boxes, params),
        };
        meter.check()?;
        let format = |source| frame_format(params, source, boxes);
        let decode = || bagtrack_ingest::decode_to(file, &service.settings.frame, &format);
        let decoded = service.tracking.decoding(decode);
        let frame = &decoded.map_err(|error| FramesError::from(FrameFault::Ingest(error)))?;
        for (target, given) in boxes.as_slice().iter().enumerate() {
            check_box(given, frame.source_size()).map_err(|error| OpenError::Box {
                error,
                listed: match boxes {
                    PerTarget::One(_) => None,
                    PerTarget::List(list) => Some((target, list.len())),
                },
            })?;
        }
        let check = || meter.check();
        let started = SessionState::start(
            frame,
            Fingerprint::of(file),
            boxes,
            params,
            expert.filter(|_| params.takes_expert()),
            check,
        );
        started.map_err(|error| match error {
            StartError::Stopped(stopped) => stopped.into(),
            error => OpenError::Start {
                error,
                listed: match boxes {
                    PerTarget::One(_) => None,
                    PerTarget::List(list) => Some(list.len()),
                },
            },
        })
    }
}
