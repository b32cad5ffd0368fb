//! How far a tracked box is from the annotated one, and what that makes over a sequence (Wu, Lim and Yang,
//! *Online Object Tracking: A Benchmark*, 2013), in the pixels of the uploaded frames.

use crate::tracker::Rect;

/// The radius, in pixels, at which precision is told.
pub const PRECISION_RADIUS: f64 = 20.0;

/// Distance between the centres of two boxes in pixels.
pub fn center_error(a: &Rect, b: &Rect) -> f64 {
    let center = |r: &Rect| (r.x + r.width / 2.0, r.y + r.height / 2.0);
    let ((a_x, a_y), (b_x, b_y)) = (center(a), center(b));
    (a_x - b_x).hypot(a_y - b_y)
}

/// Intersection over union of two boxes, 0 to 1.
pub fn overlap(a: &Rect, b: &Rect) -> f64 {
    let width = (a.x + a.width).min(b.x + b.width) - a.x.max(b.x);
    let height = (a.y + a.height).min(b.y + b.height) - a.y.max(b.y);
    let intersection = width.max(0.0) * height.max(0.0);
    intersection / (a.width * a.height + b.width * b.height - intersection)
}

/// The share of centre errors that are at most `radius` pixels, 0 to 1.
pub fn precision(center_errors: &[f64], radius: f64) -> f64 {
    share(center_errors, |error| error <= radius)
}

/// The share of overlaps that exceed `threshold`, 0 to 1.
pub fn success(overlaps: &[f64], threshold: f64) -> f64 {
    share(overlaps, |overlap| overlap > threshold)
}

/// The area under the success plot: the mean, over the 21 thresholds 0, 0.05 … 1, of the share of overlaps that
/// exceed the threshold; 0 to 1 (exactly 1 cannot be reached: no overlap exceeds 1).
pub fn success_auc(overlaps: &[f64]) -> f64 {
    let shares: Vec<f64> = (0..=20)
        .map(|step| success(overlaps, f64::from(step) / 20.0))
        .collect();
    mean(&shares)
}

/// The arithmetic mean; NaN of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The standard error of the mean: the sample standard deviation (with n − 1) by √n. None of fewer than two values.
pub fn standard_error(values: &[f64]) -> Option<f64> {
    if values.len() < 2 {
        return None;
    }
    let center = mean(values);
    let squares: f64 = values.iter().map(|value| (value - center).powi(2)).sum();
    let count = values.len() as f64;
    Some((squares / (count - 1.0) / count).sqrt())
}

fn share(values: &[f64], holds: impl Fn(f64) -> bool) -> f64 {
    values.iter().filter(|&&value| holds(value)).count() as f64 / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(x: f64, y: f64, width: f64, height: f64) -> Rect {
        Rect {
            x,
            y,
            width,
            height,
        }
    }

    #[test]
    fn center_error_is_the_distance_of_the_centres() {
        // Centres (5, 5) and (8, 9): a 3-4-5 triangle.
        assert_eq!(
            center_error(&rect(0.0, 0.0, 10.0, 10.0), &rect(6.0, 4.0, 4.0, 10.0)),
            5.0
        );
    }

    #[test]
    fn overlap_is_intersection_over_union() {
        let square = rect(0.0, 0.0, 10.0, 10.0);
        assert_eq!(overlap(&square, &square), 1.0);
        // 50 shared of 100 + 100 - 50.
        assert_eq!(overlap(&square, &rect(5.0, 0.0, 10.0, 10.0)), 50.0 / 150.0);
        // One inside the other: 25 of 100.
        assert_eq!(overlap(&square, &rect(1.0, 1.0, 5.0, 5.0)), 0.25);
        assert_eq!(overlap(&square, &rect(10.0, 0.0, 10.0, 10.0)), 0.0);
        assert_eq!(overlap(&square, &rect(40.0, 40.0, 10.0, 10.0)), 0.0);
    }

    #[test]
    fn precision_counts_the_radius_itself() {
        assert_eq!(precision(&[19.0, 20.0, 20.1, 50.0], 20.0), 0.5);
    }

    #[test]
    fn success_auc_by_hand() {
        // 1 exceeds 20 of the 21 thresholds, 0.5 exceeds 0 to 0.45 (10), 0 exceeds none.
        assert!((success_auc(&[1.0, 0.5, 0.0]) - 30.0 / 63.0).abs() < 1e-12);
    }

    #[test]
    fn standard_error_by_hand() {
        // Mean 4, squared deviations 4 + 0 + 4, variance 4, by 3 values.
        let error = standard_error(&[2.0, 4.0, 6.0]).expect("three values have one");
        assert!((error - (4.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(standard_error(&[1.0]), None);
    }
}
