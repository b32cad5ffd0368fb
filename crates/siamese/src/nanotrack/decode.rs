//! From the answer of the network's head to a box.

use bagtrack_tracker::{Rect, Sighting};

use crate::network::tensor::Tensor;

/// Pixels of the search picture from one place of the head's grid to the next.
const STRIDE: f64 = 16.0;
/// The shortest side of a box, in pixels of the frame: what the network has learned to see.
const MIN_SIDE: f64 = 4.0;

/// How the answers of the grid are weighed, as its authors chose it for each version.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weighing {
    /// How much a change of size and shape from frame to frame speaks against a place.
    pub change: f64,
    /// The share of the window, which is 1 in the middle of the search area and 0 at its edge.
    pub window: f64,
    /// How far width and height follow the network, where it is sure.
    pub rate: f64,
}

impl Weighing {
    /// The weighing for the network whose head has a grid of `places` on each side.
    pub fn of_grid(places: usize) -> Self {
        match places {
            // NanoTrack v3.
            15 => Self {
                change: 0.138,
                window: 0.455,
                rate: 0.348,
            },
            // NanoTrack v2.
            _ => Self {
                change: 0.150,
                window: 0.490,
                rate: 0.385,
            },
        }
    }
}

/// The side of the square with the area of the box grown, on each side, by half of the mean of its sides.
pub(crate) fn context_side(width: f64, height: f64) -> f64 {
    let margin = (width + height) / 2.0;
    ((width + margin) * (height + margin)).sqrt()
}

/// A prediction of one place of the grid, in pixels of the search picture, from its middle.
struct Prediction {
    center: (f64, f64),
    size: (f64, f64),
    score: f64,
    /// 1 for a box of the size and shape that the last one had, less for another.
    constancy: f64,
}

/// The box that the head's answer speaks for: `classes` and `edges` are its two outputs, `place` is the last box, and
/// `scale` the number of pixels of the search picture along one of the frame. None where the outputs are not those of
/// such a head.
pub(crate) fn decode([classes, edges]: [&Tensor; 2], place: &Rect, scale: f64) -> Option<Sighting> {
    let (2, places, columns) = classes.image()? else {
        return None;
    };
    if edges.image()? != (4, places, columns) || places != columns || places < 2 {
        return None;
    }
    let weighing = Weighing::of_grid(places);
    let area = places * places;
    let last = (place.width * scale, place.height * scale);
    let of = |index: usize| {
        let along = |at: usize| (at as f64 - (places / 2) as f64) * STRIDE;
        let at = (along(index % places), along(index / places));
        let edge = |side: usize| f64::from(edges.values[side * area + index]);
        let (left, right) = (at.0 - edge(0), at.0 + edge(2));
        let (top, bottom) = (at.1 - edge(1), at.1 + edge(3));
        let size = ((right - left).max(1e-3), (bottom - top).max(1e-3));
        let logit = classes.values[area + index] - classes.values[index];
        Prediction {
            center: ((left + right) / 2.0, (top + bottom) / 2.0),
            size,
            score: 1.0 / (1.0 + f64::from(-logit).exp()),
            constancy: (-(change(size, last) - 1.0) * weighing.change).exp(),
        }
    };
    let window = |at: usize| {
        let angle = std::f64::consts::TAU * at as f64 / (places - 1) as f64;
        0.5 - 0.5 * angle.cos()
    };
    let mut best: Option<(f64, Prediction)> = None;
    for index in 0..area {
        let prediction = of(index);
        let inner = window(index % places) * window(index / places);
        let value = prediction.score * prediction.constancy * (1.0 - weighing.window)
            + inner * weighing.window;
        // A value that is no number is never the best.
        if value > best.as_ref().map_or(f64::NEG_INFINITY, |best| best.0) {
            best = Some((value, prediction));
        }
    }
    let (_, best) = best?;
    let rate = best.score * best.constancy * weighing.rate;
    let follow = |last: f64, seen: f64| (last + (seen / scale - last) * rate).max(MIN_SIDE);
    let (x, y) = place.center();
    let target = Rect::centered(
        x + best.center.0 / scale,
        y + best.center.1 / scale,
        follow(place.width, best.size.0),
        follow(place.height, best.size.1),
    );
    Some(Sighting {
        target,
        score: best.score as f32,
    })
}

/// The ratio of a box's size to that of the last box, times the ratio of their shapes, each taken as at least 1.
fn change(size: (f64, f64), last: (f64, f64)) -> f64 {
    let ratio = |ratio: f64| ratio.max(1.0 / ratio);
    let by_size = ratio(context_side(size.0, size.1) / context_side(last.0, last.1));
    let by_shape = ratio((last.0 / last.1) / (size.0 / size.1));
    by_size * by_shape
}
