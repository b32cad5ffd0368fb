//! The way a run plays a sequence: from which frame on, and in which direction.
//!
//! The same frames played backwards, or from the middle on, serve as further videos: the first image and the changes
//! differ. What can go wrong: a run needs a box to start from. So it starts at the first annotated frame at or after
//! the chosen one, and a sequence without such a frame is refused.

use bagtrack_tracker::Rect;
use serde::Serialize;
use std::fmt;

/// How the frames of a sequence are played. The default is all of them, from the first to the last.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Playback {
    /// From the last frame to the first.
    pub backwards: bool,
    /// The share of the frames, in the order in which they are played, that are passed over, 0 ≤ share < 1: frame i of
    /// n, counted from 0, is at i / n. The run starts at the first annotated frame that is there or later.
    pub start_at: Option<f64>,
}

impl Playback {
    /// This, unless it is the default.
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
        Ok(order.split_off(start))
    }
}

/// In words: `played backwards, from 0.333 of the frames on`.
impl fmt::Display for Playback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = if self.backwards {
            "backwards"
        } else {
            "forwards"
        };
        write!(f, "played {direction}")?;
        match self.start_at {
            Some(share) => write!(f, ", from {share} of the frames on"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box for each frame that is marked with an x.
    fn boxes(marks: &str) -> Vec<Option<Rect>> {
        let annotation = Rect::new(0.0, 0.0, 2.0, 2.0);
        marks
            .chars()
            .map(|c| (c == 'x').then_some(annotation))
            .collect()
    }

    fn order(backwards: bool, start_at: Option<f64>, marks: &str) -> Result<Vec<usize>, String> {
        let playback = Playback {
            backwards,
            start_at,
        };
        playback.order(&boxes(marks))
    }

    #[test]
    fn the_default_is_every_frame_from_an_annotated_first_one() {
        assert_eq!(order(false, None, "x-x"), Ok(vec![0, 1, 2]));
        assert!(order(false, None, "-xx").is_err());
    }

    #[test]
    fn backwards_begins_at_the_last_annotated_frame() {
        assert_eq!(order(true, None, "x-x"), Ok(vec![2, 1, 0]));
        assert_eq!(order(true, None, "-xx--"), Ok(vec![2, 1, 0]));
    }

    #[test]
    fn a_share_is_counted_in_the_order_of_playing() {
        // Frames 0, 1, 2 and 3 are at 0, 1/4, 1/2 and 3/4.
        assert_eq!(order(false, Some(0.25), "xxxx"), Ok(vec![1, 2, 3]));
        assert_eq!(order(false, Some(0.26), "xxxx"), Ok(vec![2, 3]));
        assert_eq!(order(true, Some(0.25), "xxxx"), Ok(vec![2, 1, 0]));
        assert_eq!(order(false, Some(0.25), "x--x"), Ok(vec![3]));
        assert_eq!(order(false, Some(0.0), "-xx"), Ok(vec![1, 2]));
        let error = order(false, Some(0.9), "xxx-").expect_err("there is no frame at 0.9");
        assert!(error.contains("from 0.9"), "{error}");
        assert!(order(true, None, "---").is_err());
    }
}
