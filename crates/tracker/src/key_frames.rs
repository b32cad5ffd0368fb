//! Key frames of a track: the boxes from which annotation tools interpolate the others linearly.

use crate::Rect;
use std::mem;

/// Picks the key frames of one target's track, as its boxes come. Linear interpolation between two key frames gives
/// every edge of every box left out to within the tolerance.
///
/// The next key frame is as far from the last as the tolerance allows (the swing filter: Elmeleegy et al., *Online
/// piece-wise linear approximation of numerical streams with precision guarantees*, VLDB 2009, with the ends on the
/// boxes), in constant memory and time a box.
///
/// `T` is whatever goes with a box: its row, an annotation.
#[derive(Debug)]
pub struct KeyFrames<T> {
    tolerance: f64,
    segment: Option<Segment>,
    /// The last box, where it is no key frame yet.
    last: Option<(Point, T)>,
}

/// The track from a key frame on.
#[derive(Debug)]
struct Segment {
    key: Point,
    /// For each edge, the slopes of the lines from the key frame that pass every box since within the tolerance.
    slopes: [(f64, f64); 4],
}

#[derive(Debug, Clone, Copy)]
struct Point {
    /// How many boxes came before it.
    time: f64,
    /// Left, top, right, bottom.
    edges: [f64; 4],
    is_shown: bool,
}

impl Segment {
    fn from(key: Point) -> Self {
        Self {
            key,
            slopes: [(f64::NEG_INFINITY, f64::INFINITY); 4],
        }
    }

    /// The speed of an edge from the key frame to the box `to`, in pixels a frame; `more` pixels are added to the edge
    /// of `to`.
    fn slope(&self, to: &Point, edge: usize, more: f64) -> f64 {
        (to.edges[edge] + more - self.key.edges[edge]) / (to.time - self.key.time)
    }

    /// Whether a line to this box passes all boxes before it, and all of them are shown or hidden alike.
    fn reaches(&self, to: &Point) -> bool {
        let passes = |(edge, (least, most)): (usize, &(f64, f64))| {
            (*least..=*most).contains(&self.slope(to, edge, 0.0))
        };
        self.key.is_shown == to.is_shown && self.slopes.iter().enumerate().all(passes)
    }

    /// Narrows the slopes to those of lines that pass the box `by` within the tolerance.
    fn narrow(&mut self, by: &Point, tolerance: f64) {
        for edge in 0..4 {
            let least = self.slope(by, edge, -tolerance);
            let most = self.slope(by, edge, tolerance);
            let (narrowest, widest) = self.slopes[edge];
            self.slopes[edge] = (narrowest.max(least), widest.min(most));
        }
    }
}

impl<T> KeyFrames<T> {
    /// Key frames between which an interpolated edge may be off by `tolerance` pixels; a tolerance below 0 counts as 0.
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance: tolerance.max(0.0),
            segment: None,
            last: None,
        }
    }

    /// Takes the box of the next frame, and gives the key frames that are certain now, in order: none, one or two. The
    /// first box is a key frame; so are the first and the last of every run in which the target `is_shown` or is not.
    pub fn push(&mut self, target: Rect, is_shown: bool, row: T) -> impl Iterator<Item = T> {
        let edges = [
            target.x,
            target.y,
            target.x + target.width,
            target.y + target.height,
        ];
        let time = match (&self.last, &self.segment) {
            (Some((last, _)), _) => last.time + 1.0,
            (None, Some(segment)) => segment.key.time + 1.0,
            (None, None) => 0.0,
        };
        let point = Point {
            time,
            edges,
            is_shown,
        };
        let mut found = [None, None];
        let is_reached = self
            .segment
            .as_ref()
            .is_some_and(|segment| segment.reaches(&point));
        if !is_reached && let Some((last, row)) = self.last.take() {
            self.segment = Some(Segment::from(last));
            found[0] = Some(row);
        }
        match &mut self.segment {
            Some(segment) if segment.key.is_shown == is_shown => {
                segment.narrow(&point, self.tolerance);
                self.last = Some((point, row));
            }
            segment => {
                *segment = Some(Segment::from(point));
                found[1] = Some(row);
            }
        }
        found.into_iter().flatten()
    }

    /// Ends the track and gives the row of its last box, which is a key frame, unless that was given already. A box
    /// pushed afterwards begins another track.
    pub fn finish(&mut self) -> Option<T> {
        self.segment = None;
        mem::take(&mut self.last).map(|(_, row)| row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The key frames of these boxes, by their numbers.
    fn key_frames(boxes: &[(Rect, bool)]) -> Vec<usize> {
        let mut found = KeyFrames::new(1.0);
        let mut keys = Vec::new();
        for (index, (target, is_shown)) in boxes.iter().enumerate() {
            keys.extend(found.push(*target, *is_shown, index));
        }
        keys.extend(found.finish());
        keys
    }

    fn lines(from: &[(f64, f64)]) -> Vec<(Rect, bool)> {
        from.iter()
            .map(|(x, width)| (Rect::new(*x, 20.0, *width, 30.0), true))
            .collect()
    }

    #[test]
    fn a_straight_track_has_two_key_frames_and_a_turn_one_more() {
        let straight: Vec<_> = (0..50).map(|t| (2.0 * f64::from(t), 40.0)).collect();
        assert_eq!(key_frames(&lines(&straight)), [0, 49]);
        let turn: Vec<_> = (0..50)
            .map(|t: i32| (f64::from(25 - (t - 25).abs()) * 3.0, 40.0))
            .collect();
        assert_eq!(key_frames(&lines(&turn)), [0, 25, 49]);
        assert_eq!(key_frames(&lines(&[(5.0, 40.0)])), [0]);
        assert_eq!(key_frames(&[]), [0; 0]);
    }

    #[test]
    fn every_box_that_is_left_out_lies_within_the_tolerance() {
        let wave = |t: i32| {
            let t = f64::from(t);
            (
                60.0 * (t / 17.0).sin() + (t * 1.7).sin() * 0.6,
                40.0 + 12.0 * (t / 29.0).cos(),
            )
        };
        let boxes = lines(&(0..400).map(wave).collect::<Vec<_>>());
        let keys = key_frames(&boxes);
        assert!(keys.len() < 120, "{}", keys.len());
        for pair in keys.windows(2) {
            let (a, b) = (boxes[pair[0]].0, boxes[pair[1]].0);
            for (index, (target, _)) in boxes.iter().enumerate().take(pair[1]).skip(pair[0]) {
                let part = (index - pair[0]) as f64 / (pair[1] - pair[0]) as f64;
                let between = |a: f64, b: f64| a + part * (b - a);
                let left = (between(a.x, b.x) - target.x).abs();
                let right = (between(a.x + a.width, b.x + b.width) - target.x - target.width).abs();
                assert!(
                    left.max(right) <= 1.0 + 1e-9,
                    "frame {index}: {left} {right}"
                );
            }
        }
    }

    #[test]
    fn a_target_that_is_hidden_for_a_while_has_key_frames_at_both_ends_of_it() {
        let mut boxes = lines(&[(10.0, 40.0); 12]);
        for hidden in &mut boxes[4..8] {
            hidden.1 = false;
        }
        assert_eq!(key_frames(&boxes), [0, 3, 4, 7, 8, 11]);
    }
}
