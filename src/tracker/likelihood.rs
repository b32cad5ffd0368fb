//! (D) From distances to the weights of the particles (equations 9 to 12).
//!
//! exp(-dist / σ) underflows for every candidate as soon as the nearest is some hundred σ away, and 0 / 0 is no
//! likelihood. Equation 10 normalises over the candidates, so the least distance to an entry may be taken from all
//! distances to it first: the result is the same, and the largest term is always 1.

/// The normalised likelihoods p̂(Aᵢ | B\[k\]) (equations 10 and 11) of `distances`, which hold for each candidate its
/// distance to each of `entries` entries; the result in the same order. Each entry's sum over the candidates is 1.
pub(super) fn normalized(distances: &[f64], entries: usize, sigma: f64, out: &mut Vec<f64>) {
    out.clear();
    out.extend_from_slice(distances);
    for k in 0..entries {
        let column = distances.iter().skip(k).step_by(entries);
        let least = column.copied().fold(f64::INFINITY, f64::min);
        let mut sum = 0.0;
        for value in out.iter_mut().skip(k).step_by(entries) {
            *value = ((least - *value) / sigma).exp();
            sum += *value;
        }
        for value in out.iter_mut().skip(k).step_by(entries) {
            *value /= sum;
        }
    }
}

/// The weight of each particle: the sum of its likelihoods over the bag (equation 9), scaled so that the weights
/// sum to 1.
pub(super) fn sum_rule(likelihoods: &[f64], entries: usize, out: &mut Vec<f64>) {
    out.clear();
    let sums = likelihoods.chunks_exact(entries);
    out.extend(sums.map(|row| row.iter().sum::<f64>() / entries as f64));
}

/// The particle with the greatest weight (equation 12), the first of equals.
pub(super) fn arg_max(weights: &[f64]) -> usize {
    let mut best = 0;
    for (index, weight) in weights.iter().enumerate() {
        if *weight > weights[best] {
            best = index;
        }
    }
    best
}
