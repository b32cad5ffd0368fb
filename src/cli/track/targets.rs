//! The targets of `bagtrack track`: a tracker for each, which all see the same frames.

use bagtrack_ingest::Limits;
use bagtrack_sessions::{PerTarget, frame_format, largest_format};
use bagtrack_tracker::{Estimate, Expert, Frame, Params, Rect, Tracker, TrackerError};
use std::error::Error;
use std::sync::Arc;

pub struct Targets {
    trackers: Vec<Tracker>,
    frame_size: (u32, u32),
}

impl Targets {
    /// Trackers that start with `boxes` in a frame. They are the same as in a session of the service with these boxes.
    /// `expert`, where given, gives each a second opinion.
    pub fn start(
        bytes: &[u8],
        boxes: &[Rect],
        params: &Params,
        expert: Option<&Arc<dyn Expert>>,
    ) -> Result<Self, Box<dyn Error>> {
        let list = PerTarget::List(boxes.to_vec());
        let format = |source| frame_format(params, source, &list);
        let frame = bagtrack_ingest::decode_to(bytes, &Limits::default(), &format)?;
        let start = |(target, given): (usize, &Rect)| {
            let params = params.of_target(target);
            let tracker = Tracker::beside(&frame, *given, params, expert.cloned());
            tracker.map_err(|error| match boxes.len() {
                1 => error.to_string(),
                _ => format!("target {target}: {error}"),
            })
        };
        let trackers = boxes.iter().enumerate().map(start);
        Ok(Self {
            trackers: trackers.collect::<Result<_, String>>()?,
            frame_size: frame.source_size(),
        })
    }

    /// Tracks through the next frame, which is decoded once for all targets.
    pub fn step(&mut self, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
        let format = largest_format(self.trackers.iter().map(Tracker::frame_format));
        let frame = bagtrack_ingest::decode_to(bytes, &Limits::default(), &|_| format)?;
        for tracker in &mut self.trackers {
            step(tracker, &frame)?;
        }
        Ok(())
    }

    /// Width and height of the frames, in the pixels of the boxes.
    pub fn frame_size(&self) -> (u32, u32) {
        self.frame_size
    }

    /// The last answer for each target.
    pub fn estimates(&self) -> Vec<Estimate> {
        self.trackers.iter().map(Tracker::estimate).collect()
    }
}

fn step(tracker: &mut Tracker, frame: &Frame) -> Result<(), String> {
    match tracker.step(frame) {
        Ok(_) => Ok(()),
        Err(TrackerError::FrameSize {
            width,
            height,
            got_width,
            got_height,
        }) => Err(format!(
            "the frame is {got_width} x {got_height}, the frames before it are {width} x {height}; all have one size"
        )),
        Err(error) => Err(error.to_string()),
    }
}
