//! The change test: whether anything has come to a place since the target was last seen.
//!
//! A target that comes to a place changes what is seen there. A place beside the last box that looks as it did before
//! is background, however much it resembles the target. So a small image is kept of the frame in which the target was
//! last seen, and for each particle the present and the kept small image are correlated over the part of its box that
//! lay beside the target.
//!
//! The test errs on the side of the particle: where light or camera changed the place, and where the last box covered
//! it, it says nothing.

use std::ops::Range;

use crate::image::frame::Frame;
use crate::image::rect::Rect;
use crate::motion::joint_integral::JointIntegral;
use crate::motion::last_seen::{CELL, LastSeen, SmallImage, small_box};
use crate::motion::particles::{Particle, StateBounds};

/// A part of fewer pixels of the small image says nothing.
const MIN_PIXELS: u32 = 6;
/// A correlation up to this is chance: any two places of a scene share slopes of light.
const CHANCE_CORRELATION: f64 = 0.4;
/// Variance of noise, in squared gray values: added to that of each place.
const NOISE: f64 = 10.0;

/// The small images of the present frame and of the frame in which the target was last seen, compared.
#[derive(Debug, Default)]
pub(crate) struct ChangeTest {
    /// The small image of the present frame.
    pub image: SmallImage,
    integral: JointIntegral,
    /// Where the target was last seen, in pixels of the present small image; none where nothing is compared.
    last_box: Option<Rect>,
}

impl ChangeTest {
    /// Makes the small image of `frame` around the box of `particle`.
    pub fn load(&mut self, frame: &Frame, particle: &Particle, bounds: &StateBounds) {
        self.last_box = None;
        self.image.load(frame, particle, bounds);
        self.integral
            .reserve(self.image.pixels.capacity() + self.image.width());
    }

    /// Compares the small image with that of `last`, up to `radius` working pixels around the box of `displaced`, which
    /// is where the last box would be had it moved with the image.
    pub fn compare(
        &mut self,
        last: &LastSeen,
        displaced: &Particle,
        radius: f64,
        bounds: &StateBounds,
    ) {
        let Some(target) = &last.target else { return };
        let (cell, radius) = (CELL as f64, radius / CELL as f64);
        let [across, down] = [displaced.x - target.x, displaced.y - target.y]
            .map(|shift| (shift / cell).round() as isize);
        // The columns (or rows) of the present small image that the earlier one has too.
        let span = |from: f64, side: f64, now: Range<usize>, then: Range<usize>, shift: isize| {
            let first = ((from - radius).floor() as isize)
                .max(now.start as isize)
                .max(then.start as isize + shift);
            let end = ((from + side + radius).ceil() as isize)
                .min(now.end as isize)
                .min(then.end as isize + shift);
            (first < end).then_some((first as usize, end as usize))
        };
        let now = small_box(displaced, bounds);
        let ((columns_now, rows_now), (columns_then, rows_then)) =
            (self.image.part(), last.image.part());
        let columns = span(now.x, now.width, columns_now, columns_then, across);
        let rows = span(now.y, now.height, rows_now, rows_then, down);
        let (Some((left, right)), Some((top, bottom))) = (columns, rows) else {
            return;
        };
        let then = small_box(target, bounds);
        self.last_box = Some(Rect {
            x: then.x + across as f64,
            y: then.y + down as f64,
            ..then
        });
        let columns = right - left;
        let rows = (top..bottom).map(|row| {
            let then = (
                row.strict_add_signed(-down),
                left.strict_add_signed(-across),
            );
            let now = self.image.row(row, left, columns);
            (now, last.image.row(then.0, then.1, columns))
        });
        self.integral.compute((left, top), columns, rows);
    }

    /// Takes `penalty` times the share of each particle's box that is [`unchanged`](Self::unchanged) off its log-prior.
    pub fn penalize(
        &self,
        particles: &[Particle],
        bounds: &StateBounds,
        penalty: f64,
        log_priors: &mut [f64],
    ) {
        if let Some(last_box) = &self.last_box {
            for (log_prior, particle) in log_priors.iter_mut().zip(particles) {
                *log_prior -= penalty * self.unchanged(&small_box(particle, bounds), last_box);
            }
        }
    }

    /// A number in \[0, 1\]: the share of `area` that lies beside the last box, times the likeness of the two small
    /// images there. 0 where too few pixels are compared.
    fn unchanged(&self, area: &Rect, last_box: &Rect) -> f64 {
        let (pixels, sums) = self.integral.over(area);
        let (covered, covered_sums) = self.integral.over(&area.intersection(last_box));
        let beside = pixels - covered;
        if beside < MIN_PIXELS {
            return 0.0;
        }
        let mut mean = [0.0; 5];
        for (mean, (all, covered)) in mean.iter_mut().zip(sums.iter().zip(covered_sums)) {
            *mean = f64::from(all - covered) / f64::from(beside);
        }
        let [now, then, now_squared, then_squared, product] = mean;
        let variance = |square: f64, mean: f64| (square - mean * mean).max(0.0) + NOISE;
        let deviations = (variance(now_squared, now) * variance(then_squared, then)).sqrt();
        // A place that became lighter or darker as a whole has changed.
        let light = (now - then).powi(2);
        let correlation = (product - now * then) / (deviations + light);
        let likeness = (correlation - CHANCE_CORRELATION) / (1.0 - CHANCE_CORRELATION);
        (f64::from(beside) / area.area()).min(1.0) * likeness.clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: StateBounds = StateBounds {
        frame_width: 160.0,
        frame_height: 120.0,
        box_width: 30.0,
        box_height: 22.0,
    };

    fn particle(x: f64, y: f64) -> Particle {
        Particle { x, y, scale: 1.0 }
    }

    /// A scene, moved right by `shift`, in which stripes cover the box of `target`.
    fn frame(shift: usize, target: &Particle) -> Frame {
        let area = BOUNDS.area(target);
        let gray = |x: usize, y: usize| {
            let (across, down) = (x as f64 + 0.5 - area.x, y as f64 + 0.5 - area.y);
            if (0.0..area.width).contains(&across) && (0.0..area.height).contains(&down) {
                return if (across as usize / 5).is_multiple_of(2) {
                    230
                } else {
                    20
                };
            }
            let (column, row) = ((x + 400 - shift) / 6, y / 6);
            (40 + (column * column * 7 + row * row * 13 + column * row * 3) % 150) as u8
        };
        let pixels = (0..160 * 120).map(|i| gray(i % 160, i / 160)).collect();
        Frame::from_luma(160, 120, pixels).expect("a frame of this size")
    }

    /// The test of a frame with the target at `to`, after a frame with the target at `from`; the image moved by `shift`
    /// pixels.
    fn compared(from: Particle, to: Particle, shift: usize) -> ChangeTest {
        let (mut test, mut last) = (ChangeTest::default(), LastSeen::default());
        test.load(&frame(0, &from), &from, &BOUNDS);
        last.record(from, &test.image);
        test.load(&frame(shift, &to), &from, &BOUNDS);
        let displaced = particle(from.x + shift as f64, from.y);
        test.compare(&last, &displaced, 60.0, &BOUNDS);
        test
    }

    fn unchanged(test: &ChangeTest, at: Particle) -> f64 {
        let mut log_prior = [0.0];
        test.penalize(&[at], &BOUNDS, 1.0, &mut log_prior);
        -log_prior[0]
    }

    #[test]
    fn a_place_to_which_the_target_came_has_changed_and_any_other_has_not() {
        let (from, to) = (particle(50.0, 60.0), particle(100.0, 60.0));
        for shift in [0, 8] {
            let to = particle(to.x + shift as f64, to.y);
            let test = compared(from, to, shift);
            let unchanged = |x: f64, y: f64| unchanged(&test, particle(x, y));
            assert!(unchanged(to.x, to.y) < 0.1, "{shift}");
            for (x, y) in [(52.0, 30.0), (52.0, 92.0), (98.0, 30.0), (96.0, 92.0)] {
                assert!(
                    unchanged(x, y) > 0.8,
                    "{shift}: {x} {y} {}",
                    unchanged(x, y)
                );
            }
            // Half of this box is where the target was.
            let half = unchanged(from.x + shift as f64, from.y + 11.0);
            assert!((0.3..0.6).contains(&half), "{shift}: {half}");
            assert_eq!(unchanged(from.x + shift as f64, from.y), 0.0);
        }
    }

    /// The unchanged share by its definition, pixel by pixel; `last` is the earlier small image, three pixels further
    /// left.
    fn plain(test: &ChangeTest, last: &[u8], at: &Particle) -> f64 {
        let edges = |area: Rect| [area.x, area.y, area.x + area.width, area.y + area.height];
        let (now, was) = (
            edges(small_box(at, &BOUNDS)),
            edges(test.last_box.expect("a comparison")),
        );
        let within = |bounds: [f64; 4], x: usize, y: usize| {
            let [left, top, right, bottom] = bounds.map(f64::round);
            (left..right).contains(&(x as f64)) && (top..bottom).contains(&(y as f64))
        };
        let (mut sums, mut beside) = ([0.0; 5], 0.0);
        // The pixels within 60 working pixels of a box 30 wide around 52 are compared: up to pixel 32 of the small
        // image.
        for (index, &pixel) in test.image.pixels.iter().enumerate() {
            let (x, y) = (index % test.image.width(), index / test.image.width());
            if (3..32).contains(&x) && within(now, x, y) && !within(was, x, y) {
                let (a, b) = (f64::from(pixel), f64::from(last[index - 3]));
                for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                    *sum += value;
                }
                beside += 1.0;
            }
        }
        if beside < f64::from(MIN_PIXELS) {
            return 0.0;
        }
        let mean = sums.map(|sum| sum / beside);
        let variance = |square: f64, mean: f64| (square - mean * mean).max(0.0) + NOISE;
        let deviations = (variance(mean[2], mean[0]) * variance(mean[3], mean[1])).sqrt();
        let light = (mean[0] - mean[1]).powi(2);
        let correlation = (mean[4] - mean[0] * mean[1]) / (deviations + light);
        let area = (now[2] - now[0]) * (now[3] - now[1]);
        let alike =
            ((correlation - CHANCE_CORRELATION) / (1.0 - CHANCE_CORRELATION)).clamp(0.0, 1.0);
        (beside / area).min(1.0) * alike
    }

    #[test]
    fn what_is_unchanged_is_that_of_the_definition() {
        let (from, to) = (particle(40.0, 50.0), particle(70.0, 60.0));
        let test = compared(from, to, 12);
        let mut last = ChangeTest::default();
        last.load(&frame(0, &from), &from, &BOUNDS);
        let particles: Vec<Particle> = (0..203)
            .map(|i| Particle {
                x: f64::from(i * 37 % 190) - 15.3,
                y: f64::from(i * 53 % 150) - 14.7,
                scale: 0.4 + f64::from(i % 17) * 0.1,
            })
            .collect();
        let mut log_priors: Vec<f64> = (0..203).map(|i| f64::from(i) * -0.1).collect();
        let before = log_priors.clone();
        test.penalize(&particles, &BOUNDS, 6.0, &mut log_priors);
        let mut different = 0;
        for (i, particle) in particles.iter().enumerate() {
            let unchanged = plain(&test, &last.image.pixels, particle);
            let off = log_priors[i] - (before[i] - 6.0 * unchanged);
            assert!(off.abs() < 1e-12, "{particle:?}");
            different += u32::from(unchanged > 0.0);
        }
        assert!(different > 50, "{different}");
    }

    #[test]
    fn nothing_is_said_without_a_frame_before_or_of_one_too_small() {
        let mut test = ChangeTest::default();
        let target = particle(50.0, 60.0);
        test.load(&frame(0, &target), &target, &BOUNDS);
        test.compare(&LastSeen::default(), &target, 60.0, &BOUNDS);
        assert_eq!(unchanged(&test, particle(90.0, 60.0)), 0.0);
        for (width, height) in [(3, 50), (50, 3), (4, 4)] {
            let pixels = vec![7; width * height];
            let frame = Frame::from_luma(width as u32, height as u32, pixels);
            let frame = frame.expect("a frame of this size");
            let mut last = LastSeen::default();
            test.load(&frame, &target, &BOUNDS);
            last.record(particle(1.0, 1.0), &test.image);
            assert!(last.is_valid_for((width as u32, height as u32), true));
            test.load(&frame, &target, &BOUNDS);
            test.compare(&last, &particle(1.0, 1.0), 60.0, &BOUNDS);
            assert_eq!(unchanged(&test, particle(2.0, 2.0)), 0.0);
        }
    }
}
