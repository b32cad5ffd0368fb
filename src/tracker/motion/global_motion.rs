//! How far the whole picture moved from one frame to the next: a camera that swings.
//!
//! The mean gray values of columns and of rows are two short profiles of a frame. The shift at which a profile of this
//! frame fits the last one best says how far the picture moved, in a few thousand operations. A profile that fits hardly
//! better shifted than unshifted says nothing: a large target that moves, or a new scene.

use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

use crate::tracker::image::frame::GrayFrame;

/// The furthest shift looked for, in working pixels.
pub(crate) const FURTHEST: usize = 48;
/// A shift must fit this much better than none.
const BETTER: f32 = 0.7;
/// Parts of a sum, so that no addition waits for the last one.
const PARTS: usize = 4;

/// The profiles of the last frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct GlobalMotion {
    columns: Vec<f32>,
    rows: Vec<f32>,
}

/// [`GlobalMotion::look`], to be compiled for the instructions that this machine has.
struct QuantizedVector<'a> {
    global_motion: &'a mut GlobalMotion,
    frame: &'a GrayFrame,
}

impl WithSimd for QuantizedVector<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.global_motion.look_all(self.frame);
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
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        shift(simd, self.before, self.after)
    }
}

impl GlobalMotion {
    /// The profiles of `frame`.
    pub fn new(frame: &GrayFrame) -> Self {
        let mut global_motion = Self::default();
        global_motion.look(frame);
        global_motion
    }

    /// Becomes the profiles of `frame`.
    fn look(&mut self, frame: &GrayFrame) {
        Arch::new().dispatch(QuantizedVector {
            global_motion: self,
            frame,
        });
    }

    #[inline(always)]
    fn look_all(&mut self, frame: &GrayFrame) {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        self.columns.clear();
        self.columns.resize(width, 0.0);
        self.rows.clear();
        let mut bands = frame.pixels().chunks_exact(4 * width);
        for band in &mut bands {
            let (upper, lower) = band.split_at(2 * width);
            let (upper, lower) = (upper.split_at(width), lower.split_at(width));
            let upper = upper.0.iter().zip(upper.1);
            let lower = lower.0.iter().zip(lower.1);
            // Sums of gray values of a frame are below 2^24, so exact in single precision.
            for ((column, (&a, &b)), (&c, &d)) in self.columns.iter_mut().zip(upper).zip(lower) {
                let sum = u16::from(a) + u16::from(b) + u16::from(c) + u16::from(d);
                *column += f32::from(sum);
            }
        }
        for row in bands.remainder().chunks_exact(width) {
            for (column, &gray) in self.columns.iter_mut().zip(row) {
                *column += f32::from(gray);
            }
        }
        for row in frame.pixels().chunks_exact(width) {
            let sum: u32 = row.iter().map(|&gray| u32::from(gray)).sum();
            self.rows.push(sum as f32 / width as f32);
        }
        let share = height as f32;
        self.columns.iter_mut().for_each(|column| *column /= share);
    }

    /// How far the picture moved since the last frame, in whole working pixels along x and along y. `scratch` is what the
    /// profiles of this frame are put into first.
    pub fn shift(&mut self, frame: &GrayFrame, scratch: &mut Self) -> (f64, f64) {
        scratch.look(frame);
        std::mem::swap(self, scratch);
        let shift = |before, after| Arch::new().dispatch(Shift { before, after });
        (
            shift(&scratch.columns, &self.columns),
            shift(&scratch.rows, &self.rows),
        )
    }

    /// Whether this may be the profiles of frames of this size (in working pixels).
    pub fn is_valid_for(&self, width: usize, height: usize) -> bool {
        let profile = |values: &[f32], len: usize| {
            values.len() == len && values.iter().all(|value| (0.0..=255.0).contains(value))
        };
        profile(&self.columns, width) && profile(&self.rows, height)
    }
}

/// The mean of after - before - `light`, as it is or without its sign.
#[inline(always)]
fn mean<S: Simd, const UNSIGNED: bool>(simd: S, after: &[f32], before: &[f32], light: f32) -> f32 {
    let (after_lanes, after_rest) = S::as_simd_f32s(after);
    let (before_lanes, before_rest) = S::as_simd_f32s(before);
    let mut total = 0.0;
    for (after, before) in after_rest.iter().zip(before_rest) {
        let off = after - before - light;
        total += if UNSIGNED { off.abs() } else { off };
    }
    let (after_groups, after_lanes) = after_lanes.as_chunks::<PARTS>();
    let (before_groups, before_lanes) = before_lanes.as_chunks::<PARTS>();
    let light = simd.splat_f32s(light);
    let mut parts = [simd.splat_f32s(0.0); PARTS];
    for (after, before) in after_groups.iter().zip(before_groups) {
        for i in 0..PARTS {
            let off = simd.sub_f32s(simd.sub_f32s(after[i], before[i]), light);
            let off = if UNSIGNED { simd.abs_f32s(off) } else { off };
            parts[i] = simd.add_f32s(parts[i], off);
        }
    }
    for (i, (after, before)) in after_lanes.iter().zip(before_lanes).enumerate() {
        let off = simd.sub_f32s(simd.sub_f32s(*after, *before), light);
        let off = if UNSIGNED { simd.abs_f32s(off) } else { off };
        parts[i] = simd.add_f32s(parts[i], off);
    }
    let mut sum = parts[0];
    for part in &parts[1..] {
        sum = simd.add_f32s(sum, *part);
    }
    (total + simd.reduce_sum_f32s(sum)) / after.len().min(before.len()) as f32
}

/// The shift at which `after` fits `before` best, 0 where that is not clear. A change of the light is taken off.
#[inline(always)]
fn shift<S: Simd>(simd: S, before: &[f32], after: &[f32]) -> f64 {
    // So that two thirds of the profiles always overlap.
    let radius = FURTHEST.min(before.len() / 3);
    let mut best = (0, f32::INFINITY);
    let mut unshifted = 0.0;
    for step in 0..=2 * radius {
        let (forward, back) = (step.saturating_sub(radius), radius.saturating_sub(step));
        let overlap = before.len() - forward - back;
        let (after, before) = (&after[forward..][..overlap], &before[back..][..overlap]);
        let light = mean::<S, false>(simd, after, before, 0.0);
        let misfit = mean::<S, true>(simd, after, before, light);
        if step == radius {
            unshifted = misfit;
        }
        if misfit < best.1 {
            best = (step, misfit);
        }
    }
    if best.1 < BETTER * unshifted {
        best.0 as f64 - radius as f64
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
    fn profiles_are_the_means_of_columns_and_rows() {
        for (width, height) in [(33, 8), (75, 21), (320, 240)] {
            let luma = (0..width * height).map(|i| 255 - (i * 7919 / 31 % 97) as u8);
            let frame = GrayFrame::from_luma(width, height, luma.collect()).expect("a frame");
            let global_motion = GlobalMotion::new(&frame);
            let (width, height) = (width as usize, height as usize);
            let gray = |x: usize, y: usize| f64::from(frame.pixels()[y * width + x]);
            for (x, found) in global_motion.columns.iter().enumerate() {
                let sum: f64 = (0..height).map(|y| gray(x, y)).sum();
                assert!((f64::from(*found) - sum / height as f64).abs() < 1e-4);
            }
            for (y, found) in global_motion.rows.iter().enumerate() {
                let sum: f64 = (0..width).map(|x| gray(x, y)).sum();
                assert!((f64::from(*found) - sum / width as f64).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_shift_of_the_whole_picture_is_found_in_spite_of_the_light() {
        let mut global_motion = GlobalMotion::new(&scene(40, 40, 0));
        let mut scratch = GlobalMotion::default();
        let mut shift = |frame: &GrayFrame| global_motion.shift(frame, &mut scratch);
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
            let shift = GlobalMotion::new(&flat(9)).shift(&flat(200), &mut GlobalMotion::default());
            assert_eq!(shift, (0.0, 0.0));
        }
    }
}
