//! The way a run plays a sequence: from which frame on, in which direction, which frames, and from how exact a box.
//!
//! The same frames played backwards, or from the middle on, serve as further videos: the first image and the changes
//! differ. Fewer frames a second are what a client with a slow line sends, and a box drawn by hand is not exact. What
//! can go wrong: a run needs a box to start from. So it starts at the first annotated frame at or after the chosen one,
//! and a sequence without such a frame is refused.

use bagtrack_tracker::Rect;
use serde::Serialize;
use std::fmt;
use std::num::NonZeroUsize;

/// How the frames of a sequence are played. The default is all of them, from the first to the last.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Playback {
    /// Whether the frames are played from the last to the first.
    pub backwards: bool,
    /// The share of the frames, in the order in which they are played, that are passed over, 0 ≤ share < 1: frame i of
    /// n, counted from 0, is at i / n. The run starts at the first annotated frame that is there or later.
    pub start_at: Option<f64>,
    /// Of the frames from the first one on, one in so many is played; none for all.
    pub every: Option<NonZeroUsize>,
    /// By what share of its sides the first box is off, 0 < share < 0.5: each seed has another error.
    pub first_box_error: Option<f64>,
}

/// The errors of the first box, in shares of its width and height: as in OTB's spatial robustness evaluation it is
/// moved in eight directions, and made smaller and larger about its centre.
const SHIFTS: [(f64, f64); 8] = [
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.0, 1.0),
    (0.0, -1.0),
    (1.0, 1.0),
    (-1.0, -1.0),
    (1.0, -1.0),
    (-1.0, 1.0),
];
const SCALES: [f64; 4] = [1.0, -1.0, 2.0, -2.0];

impl Playback {
    /// This playback, unless it is the default.
    pub(super) fn unusual(self) -> Option<Self> {
        (self != Self::default()).then_some(self)
    }

    /// Indices of the frames in the order in which they are played; the first of them is annotated. The text of the
    /// error says why there are none.
    pub(super) fn order(&self, boxes: &[Option<Rect>]) -> Result<Vec<usize>, String> {
        let count = boxes.len();
        let mut order: Vec<usize> = (0..count).collect();
        if self.backwards {
            order.reverse();
        }
        if *self == Self::default() {
            return match boxes.first() {
                Some(Some(_)) => Ok(order),
                _ => Err("the first frame is not annotated".to_owned()),
            };
        }
        let share = self.start_at.unwrap_or(0.0);
        let passed_over = (share * count as f64).ceil() as usize;
        let annotated = |&position: &usize| boxes[order[position]].is_some();
        let Some(start) = (passed_over..count).find(annotated) else {
            return Err(format!(
                "{self}: none of the frames to be played is annotated"
            ));
        };
        let step = self.every.map_or(1, NonZeroUsize::get);
        Ok(order.split_off(start).into_iter().step_by(step).collect())
    }

    /// The box that a run with this seed begins with, where `annotated` is the exact one. After twelve seeds the errors
    /// begin anew.
    pub(super) fn first_box(&self, annotated: Rect, seed: usize) -> Rect {
        let Some(share) = self.first_box_error else {
            return annotated;
        };
        let Rect { width, height, .. } = annotated;
        let error = seed % (SHIFTS.len() + SCALES.len());
        let (x, y) = annotated.center();
        match SHIFTS.get(error) {
            Some((right, down)) => Rect::centered(
                x + right * share * width,
                y + down * share * height,
                width,
                height,
            ),
            None => {
                let factor = 1.0 + SCALES[error - SHIFTS.len()] * share;
                Rect::centered(x, y, factor * width, factor * height)
            }
        }
    }
}

/// In words: `played backwards, from 0.333 of the frames on, one frame in 2, from boxes off by 0.1`.
impl fmt::Display for Playback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = if self.backwards {
            "backwards"
        } else {
            "forwards"
        };
        write!(f, "played {direction}")?;
        if let Some(share) = self.start_at {
            write!(f, ", from {share} of the frames on")?;
        }
        if let Some(every) = self.every {
            write!(f, ", one frame in {every}")?;
        }
        match self.first_box_error {
            Some(share) => write!(f, ", from boxes off by {share}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twelve_seeds_begin_with_twelve_boxes_that_are_off_by_their_share() {
        let exact = Rect::new(10.0, 20.0, 40.0, 60.0);
        let off = Playback {
            first_box_error: Some(0.1),
            ..Playback::default()
        };
        let first: Vec<Rect> = (0..12).map(|seed| off.first_box(exact, seed)).collect();
        assert_eq!(first[0], Rect::new(14.0, 20.0, 40.0, 60.0));
        assert_eq!(first[5], Rect::new(6.0, 14.0, 40.0, 60.0));
        assert!((first[11].width - 32.0).abs() < 1e-9 && first[11].center() == exact.center());
        for (seed, one) in first.iter().enumerate() {
            assert!(first[..seed].iter().all(|other| other != one), "{seed}");
            assert!((0.6..0.9).contains(&one.overlap(&exact)), "{seed}: {one:?}");
        }
        assert_eq!(off.first_box(exact, 13), first[1]);
        assert_eq!(Playback::default().first_box(exact, 3), exact);
    }
}
