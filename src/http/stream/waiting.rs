//! The frames of a stream that have come and wait for their turn.

use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use bagtrack_api::FrameHeader;
use std::collections::VecDeque;

/// Most frames that wait behind the one at work, so that the next one is there when it is done. More would only wait
/// here instead of in the network.
const MAX_WAITING: usize = 2;

/// A frame that has come.
#[derive(Debug)]
pub struct Arrived {
    /// The frame, or why it cannot be taken.
    pub frame: Result<ArrivedFrame, Problem>,
    /// Frames directly before it that were skipped.
    pub skipped: u64,
}

/// A frame with what the client said of it.
#[derive(Debug)]
pub struct ArrivedFrame {
    /// What the text messages before the frame said of it.
    pub header: FrameHeader,
    /// The file, which holds the charge for its memory.
    pub file: Bytes,
}

impl Arrived {
    /// Whether the frame has a corrected box: then no frame without one replaces it.
    fn is_correction(&self) -> bool {
        let frame = self.frame.as_ref();
        frame.is_ok_and(|frame| frame.header.rect.is_some())
    }
}

/// The frames that wait.
#[derive(Debug)]
pub struct Waiting {
    frames: VecDeque<Arrived>,
    newest_wins: bool,
}

impl Waiting {
    /// No frames yet. Where the newest wins, the frames before it are skipped.
    pub fn new(newest_wins: bool) -> Self {
        Self {
            frames: VecDeque::new(),
            newest_wins,
        }
    }

    /// Whether frames may be skipped.
    pub fn newest_wins(&self) -> bool {
        self.newest_wins
    }

    /// Whether no further frame is to be read.
    pub fn is_full(&self) -> bool {
        !self.newest_wins && self.frames.len() >= MAX_WAITING
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Adds a frame. Where the newest wins, it replaces the frames that wait; a correction, only if it is one itself.
    pub fn push(&mut self, frame: Result<ArrivedFrame, Problem>) {
        let mut arrived = Arrived { frame, skipped: 0 };
        if self.newest_wins {
            let corrects = arrived.is_correction();
            while let Some(last) = self.frames.back()
                && (corrects || !last.is_correction())
            {
                arrived.skipped += last.skipped + 1;
                self.frames.pop_back();
            }
        }
        self.frames.push_back(arrived);
    }

    /// Whether the next frame is refused already, so that its answer takes no work.
    pub fn next_is_refused(&self) -> bool {
        self.frames.front().is_some_and(|next| next.frame.is_err())
    }

    pub fn take(&mut self) -> Option<Arrived> {
        self.frames.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(name: &'static str, corrects: bool) -> Result<ArrivedFrame, Problem> {
        let rect = corrects.then(|| "1,2,3,4".parse().unwrap());
        Ok(ArrivedFrame {
            header: FrameHeader {
                rect,
                ..FrameHeader::default()
            },
            file: Bytes::from_static(name.as_bytes()),
        })
    }

    fn taken(waiting: &mut Waiting) -> Vec<(Bytes, u64)> {
        let all = std::iter::from_fn(|| waiting.take());
        all.map(|arrived| (arrived.frame.unwrap().file, arrived.skipped))
            .collect()
    }

    #[test]
    fn frames_keep_their_order_and_a_few_fill_the_room() {
        let mut waiting = Waiting::new(false);
        waiting.push(frame("a", false));
        assert!(!waiting.is_full());
        waiting.push(frame("b", false));
        assert!(waiting.is_full());
        assert_eq!(taken(&mut waiting), [("a".into(), 0), ("b".into(), 0)]);
    }

    #[test]
    fn the_newest_wins_but_a_correction_is_skipped_only_for_another() {
        let mut waiting = Waiting::new(true);
        for name in ["a", "b", "c"] {
            waiting.push(frame(name, false));
        }
        assert!(!waiting.is_full());
        assert_eq!(taken(&mut waiting), [("c".into(), 2)]);
        waiting.push(frame("a", false));
        waiting.push(frame("correction", true));
        waiting.push(frame("b", false));
        waiting.push(frame("c", false));
        assert_eq!(
            taken(&mut waiting),
            [("correction".into(), 1), ("c".into(), 1)]
        );
        waiting.push(frame("correction", true));
        waiting.push(frame("b", false));
        waiting.push(frame("another", true));
        assert_eq!(taken(&mut waiting), [("another".into(), 2)]);
    }
}
