//! How far the whole picture moved from one frame to the next: a camera that swings.
//!
//! The mean gray values of columns and of rows are two short profiles of a frame. The shift at which a profile of this
//! frame fits the last one best says how far the picture moved, in a few thousand operations. A profile that fits hardly
//! better shifted than unshifted says nothing: a large target that moves, or a new scene.

use serde::{Deserialize, Serialize};

use super::GrayFrame;

/// The furthest shift looked for, in working pixels.
pub(super) const FURTHEST: usize = 48;
/// A shift must fit this much better than none.
const BETTER: f32 = 0.7;

/// The profiles of the last frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Camera {
    columns: Vec<f32>,
    rows: Vec<f32>,
}

impl Camera {
    /// The profiles of `frame`.
    pub fn new(frame: &GrayFrame) -> Self {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let mut columns = vec![0_u32; width];
        let mut rows = Vec::with_capacity(height);
        for row in frame.pixels().chunks_exact(width) {
            let mut sum = 0;
            for (column, &gray) in columns.iter_mut().zip(row) {
                *column += u32::from(gray);
                sum += u32::from(gray);
            }
            rows.push(sum as f32 / width as f32);
        }
        let columns = columns.iter().map(|&sum| sum as f32 / height as f32);
        Self {
            columns: columns.collect(),
            rows,
        }
    }

    /// How far the picture moved since the last frame, in whole working pixels along x and along y.
    pub fn shift(&mut self, frame: &GrayFrame) -> (f64, f64) {
        let before = std::mem::replace(self, Self::new(frame));
        (
            shift(&before.columns, &self.columns),
            shift(&before.rows, &self.rows),
        )
    }

    /// Whether this may be the profiles of frames of this size (in working pixels).
    pub fn is_sound(&self, width: usize, height: usize) -> bool {
        let profile = |values: &[f32], len: usize| {
            values.len() == len && values.iter().all(|value| (0.0..=255.0).contains(value))
        };
        profile(&self.columns, width) && profile(&self.rows, height)
    }
}

/// The shift at which `after` fits `before` best, 0 where that is not clear. A change of the light is taken off.
fn shift(before: &[f32], after: &[f32]) -> f64 {
    // So that two thirds of the profiles always overlap.
    let furthest = FURTHEST.min(before.len() / 3);
    let mut best = (0, f32::INFINITY);
    let mut unshifted = 0.0;
    for step in 0..=2 * furthest {
        let (forward, back) = (step.saturating_sub(furthest), furthest.saturating_sub(step));
        let pairs = || after[forward..].iter().zip(&before[back..]);
        let count = (before.len() - forward - back) as f32;
        let light = pairs().map(|(after, before)| after - before).sum::<f32>() / count;
        let misfit = pairs().map(|(after, before)| (after - before - light).abs());
        let misfit = misfit.sum::<f32>() / count;
        if step == furthest {
            unshifted = misfit;
        }
        if misfit < best.1 {
            best = (step, misfit);
        }
    }
    if best.1 < BETTER * unshifted {
        best.0 as f64 - furthest as f64
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(left: usize, top: usize, brighter: u8) -> GrayFrame {
        let gray = |i: usize| {
            let (x, y) = ((i % 120 + left) as f64, (i / 120 + top) as f64);
            let waves = (x * 0.13).sin() + (x * 0.041).cos() + (y * 0.09).sin() + (y * 0.17).cos();
            (110.0 + 25.0 * waves) as u8 + brighter
        };
        GrayFrame::from_luma(120, 100, (0..120 * 100).map(gray).collect()).expect("a frame")
    }

    #[test]
    fn a_shift_of_the_whole_picture_is_found_in_spite_of_the_light() {
        let mut camera = Camera::new(&scene(40, 40, 0));
        assert_eq!(camera.shift(&scene(40, 40, 9)), (0.0, 0.0));
        assert_eq!(camera.shift(&scene(33, 40, 0)), (7.0, 0.0));
        assert_eq!(camera.shift(&scene(51, 29, 5)), (-18.0, 11.0));
    }

    #[test]
    fn flat_and_tiny_frames_have_no_shift() {
        for (width, height) in [(1, 1), (2, 50), (120, 100)] {
            let flat = |gray| {
                GrayFrame::from_luma(width, height, vec![gray; (width * height) as usize])
                    .expect("a frame")
            };
            assert_eq!(Camera::new(&flat(9)).shift(&flat(200)), (0.0, 0.0));
        }
    }
}
