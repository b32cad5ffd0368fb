//! The baseline of the service: decoding and tracking in this process, on one thread.

use bagtrack_ingest::Limits;
use bagtrack_tracker::{Preset, Rect, Tracker};

use crate::Outcome;
use bagtrack_testing::cpu_time;

/// The work of a frame without a service.
pub struct InProcess {
    pictures: Vec<Vec<u8>>,
    trackers: Vec<Tracker>,
    done: usize,
}

impl InProcess {
    /// Sessions that begin with the first of `pictures`, and have seen a hundred of them each.
    pub fn new(
        pictures: Vec<Vec<u8>>,
        target: Rect,
        preset: Preset,
        sessions: u32,
    ) -> Outcome<Self> {
        let first = bagtrack_ingest::decode(&pictures[0], &Limits::default())?;
        let tracker = Tracker::new(&first, target, preset.params())?;
        let mut work = Self {
            trackers: vec![tracker; sessions as usize],
            pictures,
            done: 0,
        };
        work.run(100 * sessions)?;
        Ok(work)
    }

    /// The next picture for each session in turn.
    fn run(&mut self, frames: u32) -> Outcome<()> {
        for _ in 0..frames {
            let sessions = self.trackers.len();
            let picture = &self.pictures[(self.done / sessions + 1) % self.pictures.len()];
            let frame = bagtrack_ingest::decode(picture, &Limits::default())?;
            self.trackers[self.done % sessions].step(&frame)?;
            bagtrack_ingest::recycle(frame);
            self.done += 1;
        }
        Ok(())
    }

    /// Seconds of processor time to decode and track a frame, over so many of them.
    pub fn seconds_a_frame(&mut self, frames: u32) -> Outcome<f64> {
        let before = cpu_time::of_process(std::process::id());
        self.run(frames)?;
        Ok((cpu_time::of_process(std::process::id()) - before) / f64::from(frames))
    }
}
