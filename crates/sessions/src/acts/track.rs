//! Tracks without a session: from a first frame or a snapshot to a new snapshot.

use super::advance::largest;
use super::error::{ActError, TrackError};
use super::frames::{FrameBatch, GivenBox, RequestLimits, check_pixels};
use super::service::SessionService;
use super::start::Start;
use crate::{Boxes, Estimates, QueuePermit, SessionState, WorkMeter};
use bagtrack_tracker::{Params, box_warnings};
use bytes::Bytes;

/// Where a track without a session begins.
#[derive(Debug)]
pub enum TrackFrom {
    /// With these targets in the first frame.
    Start(Boxes, Box<Params>),
    /// At a signed snapshot; the user may correct a box in the first frame.
    Snapshot(Bytes, Option<GivenBox>),
}

/// The answers to frames without a session.
#[derive(Debug)]
pub struct TrackedAway {
    /// The answers, one for each frame, in the order of the frames.
    pub estimates: Vec<Estimates>,
    /// The track up to there, signed.
    pub snapshot: Vec<u8>,
    /// What may be wrong with the boxes that were given.
    pub warnings: Option<Vec<String>>,
}

impl SessionService {
    /// Tracks through frames, and runs `respond` with the answers on the same worker. The service keeps no state of it.
    ///
    /// # Errors
    /// The frames, the boxes, the parameters or the snapshot cannot be used, time is over, or the error of `respond`
    /// itself.
    pub async fn track<T, E, F>(
        &self,
        queue: QueuePermit,
        from: TrackFrom,
        files: Vec<Bytes>,
        respond: F,
    ) -> Result<T, E>
    where
        T: Send + 'static,
        E: From<TrackError> + From<ActError> + Send + 'static,
        F: FnOnce(TrackedAway) -> Result<T, E> + Send + 'static,
    {
        let service = self.clone();
        let queue = queue.for_frames(files.len());
        let queue = queue.for_size(0, largest(&files));
        self.run(queue, move |meter| {
            let tracked = service.track_away(from, files, meter)?;
            respond(tracked)
        })
        .await
    }

    /// Begins a track without a session, which [`Self::continue_track`] goes on with.
    ///
    /// # Errors
    /// The frame, a box or a parameter cannot be used, or time is over.
    pub async fn begin_track(
        &self,
        queue: QueuePermit,
        start: Start,
    ) -> Result<SessionState, TrackError> {
        let service = self.clone();
        let begin = move |meter: &mut WorkMeter| Ok(start.run(&service, meter)?);
        self.run(queue, begin).await
    }

    /// The track after one more frame.
    ///
    /// # Errors
    /// The frame cannot be used, or time is over.
    pub async fn continue_track(
        &self,
        queue: QueuePermit,
        mut track: SessionState,
        file: Bytes,
    ) -> Result<SessionState, TrackError> {
        let service = self.clone();
        let go_on = move |meter: &mut WorkMeter| {
            let batch = FrameBatch::posted(None, vec![file], None);
            batch.track(
                &mut track,
                &service.request_limits(),
                meter,
                &service.tracking,
            )?;
            Ok(track)
        };
        self.run(queue, go_on).await
    }

    fn track_away(
        &self,
        from: TrackFrom,
        mut files: Vec<Bytes>,
        meter: &mut WorkMeter,
    ) -> Result<TrackedAway, TrackError> {
        let limits = self.request_limits();
        let (mut estimates, mut given) = (Vec::new(), Vec::new());
        let (mut track, correction) = match from {
            TrackFrom::Snapshot(bytes, correction) => {
                given.extend(correction.map(|given| given.to));
                (Start::Snapshot(bytes).run(self, meter)?, correction)
            }
            TrackFrom::Start(boxes, params) => {
                check_pixels(&files, &limits)?;
                let file = files.remove(0);
                given.extend(boxes.as_slice());
                let track = Start::Frame {
                    file,
                    boxes,
                    params,
                }
                .run(self, meter)?;
                estimates.push(track.latest());
                (track, None)
            }
        };
        if !files.is_empty() {
            let batch = FrameBatch::posted(None, files, correction);
            let tracked = batch.track(&mut track, &limits, meter, &self.tracking);
            estimates.extend(tracked?.estimates);
        }
        Ok(TrackedAway {
            estimates,
            snapshot: track.snapshot(&self.keys),
            warnings: box_warnings(&given, track.source_size()),
        })
    }

    /// What the frames of one request may cost.
    pub fn request_limits(&self) -> RequestLimits {
        RequestLimits {
            frame: self.settings.frame,
            max_pixels: self.settings.max_request_pixels,
        }
    }
}
