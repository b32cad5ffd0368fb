//! The displacement of the whole image between two frames, as of a camera that pans.
//!
//! The mean gray values of columns and of rows are two short profiles of a frame. The displacement at which this
//! frame's profile fits the last frame's best is that of the image. Where the profile fits hardly better displaced than
//! in place, the displacement counts as 0: a large target moves, or the scene is new.

use pulp::{Arch, Simd};
use serde::{Deserialize, Serialize};

use crate::image::frame::Frame;

/// The greatest displacement looked for, in working pixels.
const RADIUS: usize = 48;
/// The misfit of a displacement must be less than this share of the misfit without displacement.
const MAX_MISFIT: f32 = 0.7;
/// Of a frame whose longer side is k times this (k rounded down), every k-th row and every k-th part of a row count.
const MAX_ALL: usize = 320;
/// Parts of a sum, so that the loops vectorise.
const PARTS: usize = 32;
/// Mean gray values are rounded to so many parts of a gray level: finer differences are noise, which no snapshot can
/// compress.
const PARTS_OF_GRAY: f32 = 16.0;

/// The profiles of a frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct GlobalMotion {
    /// The mean gray value of each column of the working image, in whole 1 / [`PARTS_OF_GRAY`].
    columns: Vec<f32>,
    /// The mean gray value of each row.
    rows: Vec<f32>,
}

impl GlobalMotion {
    /// The profiles of `frame`.
    pub fn new(frame: &Frame) -> Self {
        let mut profiles = Self::default();
        sum_up(frame, &mut profiles.columns, &mut profiles.rows);
        profiles
    }

    /// The displacement from the last frame to `frame`, in whole working pixels along x and along y; the profiles of
    /// `frame` are kept. `scratch` is a buffer.
    pub fn displacement(&mut self, frame: &Frame, scratch: &mut Self) -> (f64, f64) {
        sum_up(frame, &mut scratch.columns, &mut scratch.rows);
        std::mem::swap(self, scratch);
        (
            best_displacement(&scratch.columns, &self.columns),
            best_displacement(&scratch.rows, &self.rows),
        )
    }

    /// Whether these may be the profiles of frames of this size (in working pixels).
    pub fn is_valid_for(&self, width: usize, height: usize) -> bool {
        let is_profile = |values: &[f32], len: usize| {
            values.len() == len && values.iter().all(|value| (0.0..=255.0).contains(value))
        };
        is_profile(&self.columns, width) && is_profile(&self.rows, height)
    }
}

#[pulp::with_simd(sum_up = Arch::new())]
#[inline(always)]
fn sum_up_simd<S: Simd>(_: S, frame: &Frame, columns: &mut Vec<f32>, rows: &mut Vec<f32>) {
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    columns.clear();
    columns.resize(width, 0.0);
    rows.clear();
    // Of a large frame some rows, and some parts of each row, are enough.
    let step = (width.max(height) / MAX_ALL).max(1);
    for (y, row) in frame.pixels().chunks_exact(width).enumerate() {
        if y.is_multiple_of(step) {
            // Sums of gray values of a column are below 2^24, so exact in single precision.
            for (column, &gray) in columns.iter_mut().zip(row) {
                *column += f32::from(gray);
            }
        }
        let (mut sum, mut count) = (0, 0);
        for part in row.chunks(PARTS).step_by(step) {
            sum += part.iter().map(|&gray| u32::from(gray)).sum::<u32>();
            count += part.len();
        }
        rows.push(sum as f32 / count as f32);
    }
    let share = height.div_ceil(step) as f32;
    columns.iter_mut().for_each(|column| *column /= share);
    for gray in columns.iter_mut().chain(rows) {
        *gray = (*gray * PARTS_OF_GRAY).round_ties_even() / PARTS_OF_GRAY;
    }
}

/// The displacement at which `after` fits `before` best; 0 where that is not clear.
#[pulp::with_simd(best_displacement = Arch::new())]
#[inline(always)]
fn best_displacement_simd<S: Simd>(_: S, before: &[f32], after: &[f32]) -> f64 {
    // Bounded so that two thirds of the profiles always overlap.
    let radius = RADIUS.min(before.len() / 3);
    let mut best = (0, f32::INFINITY);
    let mut still = 0.0;
    for step in 0..=2 * radius {
        let (forward, back) = (step.saturating_sub(radius), radius.saturating_sub(step));
        let overlap = before.len() - forward - back;
        let misfit = misfit(&after[forward..][..overlap], &before[back..][..overlap]);
        if step == radius {
            still = misfit;
        }
        if misfit < best.1 {
            best = (step, misfit);
        }
    }
    match best.1 < MAX_MISFIT * still {
        true => best.0 as f64 - radius as f64,
        false => 0.0,
    }
}

/// The mean absolute difference of two profiles, less their mean difference, which is a change of the light.
#[inline(always)]
fn misfit(after: &[f32], before: &[f32]) -> f32 {
    let light = mean_of_differences(after, before, |difference| difference);
    mean_of_differences(after, before, |difference| (difference - light).abs())
}

#[inline(always)]
fn mean_of_differences(after: &[f32], before: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let mut parts = [0.0; PARTS];
    let (after_chunks, after_rest) = after.as_chunks::<PARTS>();
    let (before_chunks, before_rest) = before.as_chunks::<PARTS>();
    for (after, before) in after_chunks.iter().zip(before_chunks) {
        for part in 0..PARTS {
            parts[part] += of(after[part] - before[part]);
        }
    }
    let rest = after_rest.iter().zip(before_rest);
    let sum = parts.iter().sum::<f32>() + rest.map(|(a, b)| of(a - b)).sum::<f32>();
    sum / after.len() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(left: usize, top: usize, brighter: u8) -> Frame {
        let gray = |i: usize| {
            let (x, y) = ((i % 120 + left) as f64, (i / 120 + top) as f64);
            let waves = (x * 0.13).sin() + (x * 0.041).cos() + (y * 0.09).sin() + (y * 0.17).cos();
            (110.0 + 25.0 * waves) as u8 + brighter
        };
        Frame::from_luma(120, 100, (0..120 * 100).map(gray).collect()).expect("a frame")
    }

    #[test]
    fn profiles_are_the_means_of_columns_and_rows() {
        for (width, height) in [(33, 8), (75, 21), (320, 240)] {
            let luma = (0..width * height).map(|i| 255 - (i * 7919 / 31 % 97) as u8);
            let frame = Frame::from_luma(width, height, luma.collect()).expect("a frame");
            let global_motion = GlobalMotion::new(&frame);
            let (width, height) = (width as usize, height as usize);
            let gray = |x: usize, y: usize| f64::from(frame.pixels()[y * width + x]);
            for (x, found) in global_motion.columns.iter().enumerate() {
                let sum: f64 = (0..height).map(|y| gray(x, y)).sum();
                assert!((f64::from(*found) - sum / height as f64).abs() < 0.0314);
            }
            for (y, found) in global_motion.rows.iter().enumerate() {
                let sum: f64 = (0..width).map(|x| gray(x, y)).sum();
                assert!((f64::from(*found) - sum / width as f64).abs() < 0.0314);
            }
        }
    }

    #[test]
    fn a_displacement_of_the_image_is_found_whatever_the_light() {
        let mut global_motion = GlobalMotion::new(&scene(40, 40, 0));
        let mut scratch = GlobalMotion::default();
        let mut shift = |frame: &Frame| global_motion.displacement(frame, &mut scratch);
        assert_eq!(shift(&scene(40, 40, 9)), (0.0, 0.0));
        assert_eq!(shift(&scene(33, 40, 0)), (7.0, 0.0));
        assert_eq!(shift(&scene(51, 29, 5)), (-18.0, 11.0));
    }

    #[test]
    fn flat_and_tiny_frames_have_no_shift() {
        for (width, height) in [(1, 1), (2, 50), (120, 100)] {
            let flat = |gray| {
                Frame::from_luma(width, height, vec![gray; (width * height) as usize])
                    .expect("a frame")
            };
            let shift =
                GlobalMotion::new(&flat(9)).displacement(&flat(200), &mut GlobalMotion::default());
            assert_eq!(shift, (0.0, 0.0));
        }
    }
}
