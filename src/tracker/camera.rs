//! How far the whole picture moved from one frame to the next: a camera that swings.
//!
//! The mean gray values of columns and of rows are two short profiles of a frame. The shift at which a profile of this
//! frame fits the last one best says how far the picture moved, in a few thousand operations. A profile that fits hardly
//! better shifted than unshifted says nothing: a large target that moves, or a new scene.

use pulp::{Arch, Simd, WithSimd};
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

/// [`Camera::look`], to be compiled for the instructions that this machine has.
struct Look<'a> {
    camera: &'a mut Camera,
    frame: &'a GrayFrame,
}

impl WithSimd for Look<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.camera.look_all(self.frame);
    }
}

/// The shift of a profile, to be compiled for the instructions that this machine has.
struct Shift<'a> {
    before: &'a [f32],
    after: &'a [f32],
}

impl WithSimd for Shift<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        shift(self.before, self.after)
    }
}

impl Camera {
    /// The profiles of `frame`.
    pub fn new(frame: &GrayFrame) -> Self {
        let mut camera = Self::default();
        camera.look(frame);
        camera
    }

    /// Becomes the profiles of `frame`.
    fn look(&mut self, frame: &GrayFrame) {
        Arch::new().dispatch(Look {
            camera: self,
            frame,
        });
    }

    #[inline(always)]
    fn look_all(&mut self, frame: &GrayFrame) {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        self.columns.clear();
        self.columns.resize(width, 0.0);
        self.rows.clear();
        for row in frame.pixels().chunks_exact(width) {
            // Sums of gray values of a frame are below 2^24, so exact in single precision.
            for (column, &gray) in self.columns.iter_mut().zip(row) {
                *column += f32::from(gray);
            }
            let sum: u32 = row.iter().map(|&gray| u32::from(gray)).sum();
            self.rows.push(sum as f32 / width as f32);
        }
        let share = height as f32;
        self.columns.iter_mut().for_each(|column| *column /= share);
    }

    /// How far the picture moved since the last frame, in whole working pixels along x and along y. `room` is what the
    /// profiles of this frame are put into first.
    pub fn shift(&mut self, frame: &GrayFrame, room: &mut Self) -> (f64, f64) {
        room.look(frame);
        std::mem::swap(self, room);
        let shift = |before, after| Arch::new().dispatch(Shift { before, after });
        (
            shift(&room.columns, &self.columns),
            shift(&room.rows, &self.rows),
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

/// The mean of a function of pairs, in eight parts so that the loop vectorises.
#[inline(always)]
fn mean(after: &[f32], before: &[f32], of: impl Fn(f32, f32) -> f32) -> f32 {
    let mut parts = [0.0_f32; 8];
    let (after_chunks, after_rest) = after.as_chunks::<8>();
    let (before_chunks, before_rest) = before.as_chunks::<8>();
    for (after, before) in after_chunks.iter().zip(before_chunks) {
        for lane in 0..8 {
            parts[lane] += of(after[lane], before[lane]);
        }
    }
    let rest = after_rest.iter().zip(before_rest);
    let rest = rest.map(|(&after, &before)| of(after, before));
    (parts.iter().sum::<f32>() + rest.sum::<f32>()) / after.len().min(before.len()) as f32
}

/// The shift at which `after` fits `before` best, 0 where that is not clear. A change of the light is taken off.
#[inline(always)]
fn shift(before: &[f32], after: &[f32]) -> f64 {
    // So that two thirds of the profiles always overlap.
    let furthest = FURTHEST.min(before.len() / 3);
    let mut best = (0, f32::INFINITY);
    let mut unshifted = 0.0;
    for step in 0..=2 * furthest {
        let (forward, back) = (step.saturating_sub(furthest), furthest.saturating_sub(step));
        let overlap = before.len() - forward - back;
        let (after, before) = (&after[forward..][..overlap], &before[back..][..overlap]);
        let light = mean(after, before, |after, before| after - before);
        let misfit = mean(after, before, |after, before| {
            (after - before - light).abs()
        });
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
        let mut room = Camera::default();
        let mut shift = |frame: &GrayFrame| camera.shift(frame, &mut room);
        assert_eq!(shift(&scene(40, 40, 9)), (0.0, 0.0));
        assert_eq!(shift(&scene(33, 40, 0)), (7.0, 0.0));
        assert_eq!(shift(&scene(51, 29, 5)), (-18.0, 11.0));
    }

    #[test]
    fn flat_and_tiny_frames_have_no_shift() {
        for (width, height) in [(1, 1), (2, 50), (120, 100)] {
            let flat = |gray| {
                GrayFrame::from_luma(width, height, vec![gray; (width * height) as usize])
                    .expect("a frame")
            };
            let shift = Camera::new(&flat(9)).shift(&flat(200), &mut Camera::default());
            assert_eq!(shift, (0.0, 0.0));
        }
    }
}
