//! Summary measures of centre errors (pixels of the uploaded frames) and overlaps of a sequence, as defined by
//! Wu, Lim and Yang, *Online Object Tracking: A Benchmark*, 2013.

/// The radius, in pixels, of the reported precision.
pub const PRECISION_RADIUS: f64 = 20.0;

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
