//! (A) Whether anything has come to a place since the target was seen elsewhere.
//!
//! A target that comes to a place changes what is seen there. A place beside the last box that looks as it did before is
//! background, however much it resembles the target: for each particle, the part of its box that was not the target's
//! then is correlated with what was there. So a small picture of the frame in which the target was seen last is kept.
//!
//! It errs on the side of the particle: where light or camera changed the place, nothing is said, and nothing is said of what the
//! last box covers.

use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

use crate::tracker::image::downsample::downsample;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::motion::pair_integral::{LANES, PairIntegral};
use crate::tracker::motion::particles::{Particle, StateBounds};

/// Working pixels along a side of a pixel of the small picture: noise is averaged away, and a target of the shortest side
/// that is followed well still has some.
const CELL: usize = 4;
/// A part of fewer pixels of the small picture says nothing.
const MIN_PIXELS: f64 = 6.0;
/// A correlation up to this is chance: any two places of a scene share slopes of light.
const BY_CHANCE: f64 = 0.4;
/// Variance of a place, in squared gray values, below which it is noise that would be correlated: added to each.
const NOISE: f64 = 10.0;

/// What the frame looked like in which the target was seen last, and where it was.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct LastSeen {
    /// The small picture, row by row, and its width.
    pixels: Vec<u8>,
    width: u32,
    /// The answer; none before the first.
    target: Option<Particle>,
}

/// The small pictures of now and then, compared.
#[derive(Debug, Default)]
pub(crate) struct ChangeTest {
    /// Of this frame.
    pixels: Vec<u8>,
    width: usize,
    /// The sums of the part of it that is compared, and whether there is one.
    sums: PairIntegral,
    is_compared: bool,
    /// Where the target was then.
    was: [f64; 4],
}

/// [`ChangeTest::discount`], to be compiled for the instructions that this machine has.
struct Discount<'a> {
    arrival: &'a ChangeTest,
    particles: &'a [Particle],
    bounds: &'a StateBounds,
    weight: f64,
    exponents: &'a mut [f64],
}

impl WithSimd for Discount<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let exponents = self.exponents.chunks_mut(LANES);
        for (exponents, particles) in exponents.zip(self.particles.chunks(LANES)) {
            // The last one stands in for those that a group lacks.
            let group = std::array::from_fn(|lane| particles[lane.min(particles.len() - 1)]);
            let unchanged = self.arrival.unchanged(&group, self.bounds);
            for (exponent, unchanged) in exponents.iter_mut().zip(unchanged) {
                *exponent -= self.weight * unchanged;
            }
        }
    }
}

/// The box of `particle` in pixels of the small picture.
fn edges(particle: &Particle, bounds: &StateBounds) -> [f64; 4] {
    let cell = CELL as f64;
    let across = bounds.box_width * particle.scale / 2.0;
    let down = bounds.box_height * particle.scale / 2.0;
    [
        (particle.x - across) / cell,
        (particle.y - down) / cell,
        (particle.x + across) / cell,
        (particle.y + down) / cell,
    ]
}

impl LastSeen {
    /// The target is at `target` in the frame that `arrival` has looked at.
    pub fn record_seen(&mut self, target: Particle, arrival: &ChangeTest) {
        self.pixels.clone_from(&arrival.pixels);
        self.width = arrival.width as u32;
        self.target = Some(target);
    }

    /// Whether this may be what a tracker of working images of this size has seen last, if it keeps that.
    pub fn is_valid_for(&self, (width, height): (u32, u32), kept: bool) -> bool {
        let (columns, rows) = (width as usize / CELL, height as usize / CELL);
        let fits = self.width as usize == columns && self.pixels.len() == columns * rows;
        let finite = |target: &Particle| {
            [target.x, target.y, target.scale]
                .iter()
                .all(|value| value.abs() <= 1e6)
        };
        match &self.target {
            Some(target) => kept && fits && finite(target),
            None => !kept && *self == Self::default(),
        }
    }
}

impl ChangeTest {
    /// Makes the small picture of `frame`.
    pub fn take(&mut self, frame: &GrayFrame) {
        self.is_compared = false;
        self.width = downsample(frame, CELL, &mut self.pixels);
        let rows = self.pixels.len() / self.width.max(1);
        self.sums.prepare(self.width, rows);
    }

    /// Compares the small picture with the last one, `away` working pixels around the box of `displaced`, which is where
    /// the last box would be had it moved with the picture.
    pub fn compare(
        &mut self,
        last: &LastSeen,
        displaced: &Particle,
        away: f64,
        bounds: &StateBounds,
    ) {
        let Some(target) = &last.target else { return };
        if self.width == 0 || last.pixels.len() != self.pixels.len() {
            return;
        }
        let cell = CELL as f64;
        let [shift_x, shift_y] = [displaced.x - target.x, displaced.y - target.y]
            .map(|shift| (shift / cell).round() as isize);
        let height = self.pixels.len() / self.width;
        // Where a pixel of now has one of then.
        let span = |from: f64, until: f64, len: usize, shift: isize| {
            let len = len as isize;
            let first = ((from - away / cell).floor() as isize).max(0).max(shift);
            let end = ((until + away / cell).ceil() as isize)
                .min(len)
                .min(len + shift);
            (first < end).then_some((first as usize, end as usize))
        };
        let now = edges(displaced, bounds);
        let (Some((left, right)), Some((top, bottom))) = (
            span(now[0], now[2], self.width, shift_x),
            span(now[1], now[3], height, shift_y),
        ) else {
            return;
        };
        self.is_compared = true;
        let was = edges(target, bounds);
        let [across, down] = [shift_x, shift_y].map(|shift| shift as f64);
        self.was = [
            was[0] + across,
            was[1] + down,
            was[2] + across,
            was[3] + down,
        ];

        let (width, columns, pixels) = (self.width, right - left, &self.pixels);
        let rows = (top..bottom).map(|row| {
            let now = &pixels[row * width + left..][..columns];
            let row = row.strict_add_signed(-shift_y);
            let left = left.strict_add_signed(-shift_x);
            (now, &last.pixels[row * width + left..][..columns])
        });
        self.sums.compute((left, top), columns, rows);
    }

    /// Takes off the exponents of `particles` `weight` times how much of the box of each is beside the last box and looks
    /// as it did then: a share of the box, less as it looks less so. In [0, 1]; 0 where nothing is known.
    pub fn discount(
        &self,
        particles: &[Particle],
        bounds: &StateBounds,
        weight: f64,
        exponents: &mut [f64],
    ) {
        if self.is_compared {
            Arch::new().dispatch(Discount {
                arrival: self,
                particles,
                bounds,
                weight,
                exponents,
            });
        }
    }

    #[inline(always)]
    fn unchanged(&self, particles: &[Particle; LANES], bounds: &StateBounds) -> [f64; LANES] {
        let (mut now, mut both) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
        for lane in 0..LANES {
            let bounds = edges(&particles[lane], bounds);
            for side in 0..4 {
                let (of_now, was) = (bounds[side], self.was[side]);
                now[side][lane] = of_now;
                let inner = if side < 2 { of_now > was } else { of_now < was };
                both[side][lane] = if inner { of_now } else { was };
            }
        }
        let (all, covered) = (self.sums.corners(&now), self.sums.corners(&both));
        let (pixels, fewer) = (PairIntegral::pixels(&all), PairIntegral::pixels(&covered));
        let mut mean = [[0.0; LANES]; 5];
        for lane in 0..LANES {
            let (all, covered) = (self.sums.over(&all, lane), self.sums.over(&covered, lane));
            for (mean, (all, covered)) in mean.iter_mut().zip(all.iter().zip(covered)) {
                mean[lane] = f64::from(all - covered);
            }
        }
        let mut unchanged = [0.0; LANES];
        for lane in 0..LANES {
            let beside = f64::from(pixels[lane] - fewer[lane]);
            let mean = mean.map(|mean| mean[lane] / beside);
            let variance = |square: f64, mean: f64| (square - mean * mean).max(0.0) + NOISE;
            let deviations = (variance(mean[2], mean[0]) * variance(mean[3], mean[1])).sqrt();
            // A place that became lighter or darker as a whole has changed.
            let light = (mean[0] - mean[1]).powi(2);
            let correlation = (mean[4] - mean[0] * mean[1]) / (deviations + light);
            let area = (now[2][lane] - now[0][lane]) * (now[3][lane] - now[1][lane]);
            let alike = ((correlation - BY_CHANCE) / (1.0 - BY_CHANCE)).clamp(0.0, 1.0);
            let share = (beside / area).min(1.0) * alike;
            unchanged[lane] = if beside < MIN_PIXELS { 0.0 } else { share };
        }
        unchanged
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

    /// A scene, moved right by `shift`, on which something striped covers the box of `target`.
    fn frame(shift: usize, target: &Particle) -> GrayFrame {
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
        GrayFrame::from_luma(160, 120, pixels).expect("a frame of this size")
    }

    /// What has arrived in a frame, after one that had the target at `from`, when the picture moved by `shift`.
    fn arrival(from: Particle, to: Particle, shift: usize) -> ChangeTest {
        let (mut arrival, mut last) = (ChangeTest::default(), LastSeen::default());
        arrival.take(&frame(0, &from));
        last.record_seen(from, &arrival);
        arrival.take(&frame(shift, &to));
        let displaced = particle(from.x + shift as f64, from.y);
        arrival.compare(&last, &displaced, 60.0, &BOUNDS);
        arrival
    }

    fn unchanged(arrival: &ChangeTest, at: Particle) -> f64 {
        let mut exponent = [0.0];
        arrival.discount(&[at], &BOUNDS, 1.0, &mut exponent);
        -exponent[0]
    }

    #[test]
    fn a_place_to_which_the_target_came_has_changed_and_any_other_has_not() {
        let (from, to) = (particle(50.0, 60.0), particle(100.0, 60.0));
        for shift in [0, 8] {
            let to = particle(to.x + shift as f64, to.y);
            let arrival = arrival(from, to, shift);
            let unchanged = |x: f64, y: f64| unchanged(&arrival, particle(x, y));
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

    /// The same by its definition, pixel by pixel: `last` is the small picture of then, three pixels further left.
    fn plain(arrival: &ChangeTest, last: &[u8], at: &Particle) -> f64 {
        let (now, was) = (edges(at, &BOUNDS), arrival.was);
        let within = |bounds: [f64; 4], x: usize, y: usize| {
            let [left, top, right, bottom] = bounds.map(f64::round);
            (left..right).contains(&(x as f64)) && (top..bottom).contains(&(y as f64))
        };
        let (mut sums, mut beside) = ([0.0; 5], 0.0);
        // Compared is what is within 60 pixels of a box 30 wide around 52: up to pixel 32.
        for index in 0..last.len() {
            let (x, y) = (index % arrival.width, index / arrival.width);
            if (3..32).contains(&x) && within(now, x, y) && !within(was, x, y) {
                let (a, b) = (arrival.pixels[index], last[index - 3]);
                let (a, b) = (f64::from(a), f64::from(b));
                for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                    *sum += value;
                }
                beside += 1.0;
            }
        }
        if beside < MIN_PIXELS {
            return 0.0;
        }
        let mean = sums.map(|sum| sum / beside);
        let variance = |square: f64, mean: f64| (square - mean * mean).max(0.0) + NOISE;
        let deviations = (variance(mean[2], mean[0]) * variance(mean[3], mean[1])).sqrt();
        let light = (mean[0] - mean[1]).powi(2);
        let correlation = (mean[4] - mean[0] * mean[1]) / (deviations + light);
        let area = (now[2] - now[0]) * (now[3] - now[1]);
        let alike = ((correlation - BY_CHANCE) / (1.0 - BY_CHANCE)).clamp(0.0, 1.0);
        (beside / area).min(1.0) * alike
    }

    #[test]
    fn what_is_unchanged_is_that_of_the_definition() {
        let (from, to) = (particle(40.0, 50.0), particle(70.0, 60.0));
        let arrival = arrival(from, to, 12);
        let mut last = ChangeTest::default();
        last.take(&frame(0, &from));
        let particles: Vec<Particle> = (0..203)
            .map(|i| Particle {
                x: f64::from(i * 37 % 190) - 15.3,
                y: f64::from(i * 53 % 150) - 14.7,
                scale: 0.4 + f64::from(i % 17) * 0.1,
            })
            .collect();
        let mut exponents: Vec<f64> = (0..203).map(|i| f64::from(i) * -0.1).collect();
        let before = exponents.clone();
        arrival.discount(&particles, &BOUNDS, 6.0, &mut exponents);
        let mut different = 0;
        for (i, particle) in particles.iter().enumerate() {
            let unchanged = plain(&arrival, &last.pixels, particle);
            assert_eq!(exponents[i], before[i] - 6.0 * unchanged, "{particle:?}");
            different += u32::from(unchanged > 0.0);
        }
        assert!(different > 50, "{different}");
    }

    #[test]
    fn nothing_is_said_without_a_frame_before_or_of_one_too_small() {
        let mut arrival = ChangeTest::default();
        let target = particle(50.0, 60.0);
        arrival.take(&frame(0, &target));
        arrival.compare(&LastSeen::default(), &target, 60.0, &BOUNDS);
        assert_eq!(unchanged(&arrival, particle(90.0, 60.0)), 0.0);
        for (width, height) in [(3, 50), (50, 3), (4, 4)] {
            let pixels = vec![7; width * height];
            let frame = GrayFrame::from_luma(width as u32, height as u32, pixels);
            let frame = frame.expect("a frame of this size");
            let mut last = LastSeen::default();
            arrival.take(&frame);
            last.record_seen(particle(1.0, 1.0), &arrival);
            assert!(last.is_valid_for((width as u32, height as u32), true));
            arrival.take(&frame);
            arrival.compare(&last, &particle(1.0, 1.0), 60.0, &BOUNDS);
            assert_eq!(unchanged(&arrival, particle(2.0, 2.0)), 0.0);
        }
    }
}
