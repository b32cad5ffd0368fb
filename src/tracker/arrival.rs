//! (A) Whether anything has come to a place since the target was seen elsewhere.
//!
//! A target that comes to a place changes what is seen there. A place beside the last box that looks as it did before is
//! background, however much it resembles the target: for each particle, the part of its box that was not the target's
//! then is correlated with what was there. So a small picture of the frame in which the target was seen last is kept.
//!
//! It errs on the side of the particle: where light or camera changed the place, nothing is said, and nothing is said of what the
//! last box covers.

use serde::{Deserialize, Serialize};

use super::GrayFrame;
use super::comparison;
use super::motion::{Particle, Reach};

/// Working pixels, along x and along y, that are one of the small picture: noise is averaged away, and a target of the
/// shortest side that is followed well still has some.
const CELL: usize = 4;
/// A part of fewer pixels of the small picture says nothing.
const LEAST_PIXELS: f64 = 6.0;
/// A correlation up to this is chance: any two places of a scene share slopes of light.
const BY_CHANCE: f64 = 0.4;
/// Variance of a place, in squared gray values, below which it is noise that would be correlated: added to each.
const NOISE: f64 = 10.0;

/// What the frame looked like in which the target was seen last, and where it was.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct LastSeen {
    /// The small picture, row by row, and its width.
    pixels: Vec<u8>,
    width: u32,
    /// The answer; none before the first.
    target: Option<Particle>,
}

/// Sums of the gray values now, then, of their squares and of their products.
type Sums = [u32; 5];

/// A rectangle of the small picture: left, top, right, bottom.
type Bounds = [usize; 4];

/// The small pictures of now and then, compared.
#[derive(Debug, Default)]
pub(super) struct Arrival {
    /// Of this frame.
    pixels: Vec<u8>,
    width: usize,
    /// The part of it that is compared; none where it is not.
    part: Option<Bounds>,
    /// Above and left of each corner of a pixel in the part.
    sums: Vec<Sums>,
    /// Where the target was then.
    was: [f64; 4],
}

/// The mean of each cell of `frame`, row by row; how many there are in a row.
fn shrink(frame: &GrayFrame, out: &mut Vec<u8>) -> usize {
    let width = frame.width() as usize;
    let (columns, rows) = (width / CELL, frame.height() as usize / CELL);
    comparison::empty(out, columns * rows);
    out.resize(columns * rows, 0);
    if columns == 0 {
        return 0;
    }
    for (j, out) in out.chunks_exact_mut(columns).enumerate() {
        let lines: [_; CELL] = std::array::from_fn(|line| {
            frame.pixels()[(CELL * j + line) * width..]
                .as_chunks::<CELL>()
                .0
        });
        for (i, out) in out.iter_mut().enumerate() {
            let sum: u16 = lines.iter().flat_map(|line| line[i]).map(u16::from).sum();
            *out = ((sum + 8) / 16) as u8;
        }
    }
    columns
}

/// The box of `particle` in pixels of the small picture.
fn bounds(particle: &Particle, reach: &Reach) -> [f64; 4] {
    let cell = CELL as f64;
    let across = reach.box_width * particle.scale / 2.0;
    let down = reach.box_height * particle.scale / 2.0;
    [
        (particle.x - across) / cell,
        (particle.y - down) / cell,
        (particle.x + across) / cell,
        (particle.y + down) / cell,
    ]
}

impl LastSeen {
    /// The target is at `target` in the frame that `arrival` has looked at.
    pub fn see(&mut self, target: Particle, arrival: &Arrival) {
        self.pixels.clone_from(&arrival.pixels);
        self.width = arrival.width as u32;
        self.target = Some(target);
    }

    /// Whether this may be what a tracker of working images of this size has seen last, if it keeps that.
    pub fn is_sound(&self, (width, height): (u32, u32), kept: bool) -> bool {
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

impl Arrival {
    /// Makes the small picture of `frame`.
    pub fn take(&mut self, frame: &GrayFrame) {
        self.part = None;
        self.width = shrink(frame, &mut self.pixels);
        let corners = (self.width + 1) * (self.pixels.len() / self.width.max(1) + 1);
        comparison::empty(&mut self.sums, corners);
    }

    /// Compares the small picture with the last one, `away` working pixels around the box of `carried`, which is where
    /// the last box would be had it moved with the picture.
    pub fn compare(&mut self, last: &LastSeen, carried: &Particle, away: f64, reach: &Reach) {
        let Some(target) = &last.target else { return };
        if self.width == 0 || last.pixels.len() != self.pixels.len() {
            return;
        }
        let cell = CELL as f64;
        let [shift_x, shift_y] = [carried.x - target.x, carried.y - target.y]
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
        let now = bounds(carried, reach);
        let (Some((left, right)), Some((top, bottom))) = (
            span(now[0], now[2], self.width, shift_x),
            span(now[1], now[3], height, shift_y),
        ) else {
            return;
        };
        self.part = Some([left, top, right, bottom]);
        let was = bounds(target, reach);
        let [across, down] = [shift_x, shift_y].map(|shift| shift as f64);
        self.was = [
            was[0] + across,
            was[1] + down,
            was[2] + across,
            was[3] + down,
        ];

        let stride = right - left + 1;
        self.sums.resize(stride, Sums::default());
        for row in top..bottom {
            let now = &self.pixels[row * self.width..][left..right];
            let then = row.strict_add_signed(-shift_y) * self.width;
            let then = &last.pixels[then..][left.strict_add_signed(-shift_x)..][..right - left];
            let mut of_row = Sums::default();
            self.sums.push(of_row);
            for (&now, &then) in now.iter().zip(then) {
                let (now, then) = (u32::from(now), u32::from(then));
                let values = [now, then, now * now, then * then, now * then];
                let above = self.sums[self.sums.len() - stride];
                // At most 80 x 80 squares of 255: below 2³².
                for (sum, value) in of_row.iter_mut().zip(values) {
                    *sum += value;
                }
                self.sums
                    .push(std::array::from_fn(|k| above[k] + of_row[k]));
            }
        }
    }

    /// The sums over what `bounds` has of the part, and how many pixels that is.
    fn sums(&self, [left, top, right, bottom]: Bounds, bounds: [f64; 4]) -> ([f64; 5], f64) {
        let corner = |at: f64, first: usize, end: usize| {
            (at.round().clamp(first as f64, end as f64)) as usize - first
        };
        let (x0, x1) = (
            corner(bounds[0], left, right),
            corner(bounds[2], left, right),
        );
        let (y0, y1) = (
            corner(bounds[1], top, bottom),
            corner(bounds[3], top, bottom),
        );
        if x0 >= x1 || y0 >= y1 {
            return ([0.0; 5], 0.0);
        }
        let at = |x: usize, y: usize| &self.sums[y * (right - left + 1) + x];
        let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
        let sums = std::array::from_fn(|k| f64::from(d[k] + a[k] - b[k] - c[k]));
        (sums, ((x1 - x0) * (y1 - y0)) as f64)
    }

    /// How much of the box of `particle` is beside the last box and looks as it did then: a share of the box, less as
    /// it looks less so. In [0, 1]; 0 where nothing is known.
    pub fn unchanged(&self, particle: &Particle, reach: &Reach) -> f64 {
        let Some(part) = self.part else { return 0.0 };
        let now = bounds(particle, reach);
        let both = [
            now[0].max(self.was[0]),
            now[1].max(self.was[1]),
            now[2].min(self.was[2]),
            now[3].min(self.was[3]),
        ];
        let (all, pixels) = self.sums(part, now);
        let (covered, fewer) = self.sums(part, both);
        let beside = pixels - fewer;
        if beside < LEAST_PIXELS {
            return 0.0;
        }
        let mean: [f64; 5] = std::array::from_fn(|k| (all[k] - covered[k]) / beside);
        let variance = |square: f64, mean: f64| (square - mean * mean).max(0.0) + NOISE;
        let deviations = (variance(mean[2], mean[0]) * variance(mean[3], mean[1])).sqrt();
        // A place that became lighter or darker as a whole has changed.
        let light = (mean[0] - mean[1]).powi(2);
        let correlation = (mean[4] - mean[0] * mean[1]) / (deviations + light);
        let area = (now[2] - now[0]) * (now[3] - now[1]);
        let alike = ((correlation - BY_CHANCE) / (1.0 - BY_CHANCE)).clamp(0.0, 1.0);
        (beside / area).min(1.0) * alike
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REACH: Reach = Reach {
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
        let area = REACH.area(target);
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
    fn arrival(from: Particle, to: Particle, shift: usize) -> Arrival {
        let (mut arrival, mut last) = (Arrival::default(), LastSeen::default());
        arrival.take(&frame(0, &from));
        last.see(from, &arrival);
        arrival.take(&frame(shift, &to));
        let carried = particle(from.x + shift as f64, from.y);
        arrival.compare(&last, &carried, 60.0, &REACH);
        arrival
    }

    #[test]
    fn a_place_to_which_the_target_came_has_changed_and_any_other_has_not() {
        let (from, to) = (particle(50.0, 60.0), particle(100.0, 60.0));
        for shift in [0, 8] {
            let to = particle(to.x + shift as f64, to.y);
            let arrival = arrival(from, to, shift);
            let unchanged = |x: f64, y: f64| arrival.unchanged(&particle(x, y), &REACH);
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

    #[test]
    fn sums_are_those_of_the_pixels() {
        let arrival = arrival(particle(40.0, 50.0), particle(70.0, 60.0), 12);
        let part = arrival.part.expect("both frames have this part");
        let (sums, count) = arrival.sums(part, [3.2, 4.0, 9.6, 8.7]);
        assert_eq!(count, 35.0);
        let mut expected = 0.0;
        for row in 4..9 {
            for column in part[0].max(3)..10 {
                expected += f64::from(arrival.pixels[row * arrival.width + column]);
            }
        }
        assert_eq!(sums[0], expected);
    }

    #[test]
    fn nothing_is_said_without_a_frame_before_or_of_one_too_small() {
        let mut arrival = Arrival::default();
        let target = particle(50.0, 60.0);
        arrival.take(&frame(0, &target));
        arrival.compare(&LastSeen::default(), &target, 60.0, &REACH);
        assert_eq!(arrival.unchanged(&particle(90.0, 60.0), &REACH), 0.0);
        for (width, height) in [(3, 50), (50, 3), (4, 4)] {
            let pixels = vec![7; width * height];
            let frame = GrayFrame::from_luma(width as u32, height as u32, pixels);
            let frame = frame.expect("a frame of this size");
            let mut last = LastSeen::default();
            arrival.take(&frame);
            last.see(particle(1.0, 1.0), &arrival);
            assert!(last.is_sound((width as u32, height as u32), true));
            arrival.take(&frame);
            arrival.compare(&last, &particle(1.0, 1.0), 60.0, &REACH);
            assert_eq!(arrival.unchanged(&particle(2.0, 2.0), &REACH), 0.0);
        }
    }
}
