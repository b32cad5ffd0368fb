//! The textbook version of section III-B and III-D: V is built and decomposed, bases are multiplied, singular values
//! taken, `acos` applied; all in double precision with nalgebra, and as slow as it reads. It is the oracle that the
//! shipped evaluation is held to.

use std::f64::consts::PI;

use bagtrack_tracker::{
    AffineSubspace, Evaluation, Likelihoods, Params, RANK_TOLERANCE, sum_rule_weights,
};
use nalgebra::{DMatrix, DVector};

/// An affine subspace (equation 1).
pub struct Subspace {
    pub mean: DVector<f64>,
    pub basis: DMatrix<f64>,
}

fn vector(values: &[f32]) -> DVector<f64> {
    DVector::from_iterator(values.len(), values.iter().map(|&value| f64::from(value)))
}

impl Subspace {
    /// Mean and n dominant left singular vectors of the columns (equation 2).
    pub fn of(columns: &[&[f32]], basis_dim: usize) -> Self {
        let columns: Vec<DVector<f64>> = columns.iter().map(|column| vector(column)).collect();
        let v = DMatrix::from_columns(&columns);
        let mean = v.column_mean();
        let scaled = left_singular(&v);
        let largest = scaled[0].norm();
        let kept: Vec<DVector<f64>> = scaled
            .iter()
            .take(basis_dim)
            .filter(|column| column.norm() > largest * RANK_TOLERANCE)
            .map(DVector::normalize)
            .collect();
        let basis = if kept.is_empty() {
            DMatrix::zeros(mean.len(), 0)
        } else {
            DMatrix::from_columns(&kept)
        };
        Self { mean, basis }
    }

    /// An entry of the bag, as it is stored.
    pub fn stored(entry: &AffineSubspace) -> Self {
        let columns: Vec<DVector<f64>> = entry.basis().map(vector).collect();
        let mean = vector(entry.mean());
        let basis = if columns.is_empty() {
            DMatrix::zeros(mean.len(), 0)
        } else {
            DMatrix::from_columns(&columns)
        };
        Self { mean, basis }
    }
}

/// The left singular vectors, each times its singular value, largest first.
///
/// nalgebra 0.35 stops its SVD early on small singular values (dimforge/nalgebra issue 1172; they were seen off by
/// 5e-5 here), so what it returns is finished by one-sided Jacobi rotations until the columns are orthogonal.
fn left_singular(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let right = matrix.clone().svd(false, true).v_t;
    let product = matrix
        * right
            .expect("the right singular vectors were asked for")
            .transpose();
    let mut columns: Vec<DVector<f64>> = product.column_iter().map(|c| c.into_owned()).collect();
    for _sweep in 0..30 {
        let mut turned = false;
        for p in 0..columns.len() {
            for q in p + 1..columns.len() {
                let (a, b) = (columns[p].norm_squared(), columns[q].norm_squared());
                let product = columns[p].dot(&columns[q]);
                if product.abs() <= 1e-15 * (a * b).sqrt() || a.min(b) < 1e-28 * a.max(b) {
                    continue;
                }
                turned = true;
                let angle = 0.5 * (2.0 * product).atan2(a - b);
                let (sine, cosine) = angle.sin_cos();
                let turned_p = &columns[p] * cosine + &columns[q] * sine;
                columns[q] = &columns[q] * cosine - &columns[p] * sine;
                columns[p] = turned_p;
            }
        }
        if !turned {
            break;
        }
    }
    columns.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    columns
}

/// Equations 4 to 8.
pub fn distance(a: &Subspace, b: &Subspace, alpha: f64) -> f64 {
    let origin = (&a.mean - &b.mean).norm_squared() / a.mean.len() as f64;
    let dim = a.basis.ncols().min(b.basis.ncols());
    let grassmann = if dim == 0 {
        0.0
    } else {
        let scaled = left_singular(&(a.basis.transpose() * &b.basis));
        let cosines = scaled[..dim].iter().map(DVector::norm);
        let angles = cosines.map(|value| value.min(1.0).acos());
        4.0 / (dim as f64 * PI * PI) * angles.map(|angle| angle * angle).sum::<f64>()
    };
    alpha * origin + (1.0 - alpha) * grassmann
}

/// What the textbook says about the candidates of a frame.
pub struct Answer {
    /// For each candidate, the distance to each entry.
    pub distances: Vec<Vec<f64>>,
    /// For each candidate, the normalised likelihood for each entry (equations 10 and 11).
    pub likelihoods: Vec<Vec<f64>>,
    /// For each candidate, the sum over the bag (equation 9) by the number of entries.
    pub weights: Vec<f64>,
}

/// Section III-D for one frame.
pub fn evaluate(
    candidates: &[Vec<f32>],
    history: &[&[f32]],
    bag: &[AffineSubspace],
    params: &Params,
) -> Answer {
    let entries: Vec<Subspace> = bag.iter().map(Subspace::stored).collect();
    let distances: Vec<Vec<f64>> = candidates
        .iter()
        .map(|candidate| {
            let mut columns: Vec<&[f32]> = vec![candidate];
            columns.extend(history);
            let subspace = Subspace::of(&columns, params.basis_dim as usize);
            let to = |entry| distance(&subspace, entry, params.alpha);
            entries.iter().map(to).collect()
        })
        .collect();
    // In logarithms, so that far candidates do not underflow to 0 / 0.
    let mut likelihoods = vec![vec![0.0; bag.len()]; candidates.len()];
    for k in 0..bag.len() {
        let logs: Vec<f64> = distances.iter().map(|row| -row[k] / params.sigma).collect();
        let greatest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = logs.iter().map(|log| (log - greatest).exp()).sum();
        for (row, log) in likelihoods.iter_mut().zip(&logs) {
            row[k] = (log - greatest - total.ln()).exp();
        }
    }
    let weights = likelihoods
        .iter()
        .map(|row| row.iter().sum::<f64>() / bag.len() as f64)
        .collect();
    Answer {
        distances,
        likelihoods,
        weights,
    }
}

/// The shipped evaluation of the same, as `Tracker::step` does it.
pub struct Shipped {
    evaluation: Evaluation,
    likelihoods: Likelihoods,
    sigma: f64,
    /// For each candidate, the distance to each entry.
    distances: Vec<f64>,
    pub weights: Vec<f64>,
}

impl Shipped {
    /// From feature vectors, one after the other, to weights.
    pub fn compute(&mut self, candidates: &[f32], history: &[&[f32]]) {
        let distances = self
            .evaluation
            .distances(candidates, history.iter().copied());
        self.distances.clear();
        self.distances.extend_from_slice(distances);
        self.weights.fill(0.0);
        sum_rule_weights(
            &mut self.likelihoods,
            &self.distances,
            self.sigma,
            (0, 1.0),
            &mut self.weights,
        );
    }
}

/// The shipped evaluation of these candidates.
pub fn shipped(
    candidates: &[Vec<f32>],
    history: &[&[f32]],
    bag: &[AffineSubspace],
    params: &Params,
) -> Shipped {
    let mut shipped = Shipped {
        evaluation: Evaluation::new(params),
        likelihoods: Likelihoods::default(),
        sigma: params.sigma,
        distances: Vec::new(),
        weights: vec![0.0; candidates.len()],
    };
    shipped.evaluation.set_bag(bag.iter());
    shipped.compute(&candidates.concat(), history);
    shipped
}

/// The greatest differences between the shipped evaluation and the textbook's: of distances, of likelihoods, of
/// weights.
pub fn differences(
    candidates: &[Vec<f32>],
    history: &[&[f32]],
    bag: &[AffineSubspace],
    params: &Params,
) -> [f64; 3] {
    let textbook = evaluate(candidates, history, bag, params);
    let shipped = shipped(candidates, history, bag, params);
    let mut greatest = [0.0_f64; 3];
    let mut note = |which: usize, a: f64, b: f64| {
        assert!(a.is_finite() && b.is_finite(), "{a} against {b}");
        greatest[which] = greatest[which].max((a - b).abs());
    };
    for (index, row) in textbook.distances.iter().enumerate() {
        for (k, &distance) in row.iter().enumerate() {
            let at = index * row.len() + k;
            note(0, shipped.distances[at], distance);
            let likelihood = shipped.likelihoods.normalized()[at];
            note(1, likelihood, textbook.likelihoods[index][k]);
        }
        note(2, shipped.weights[index], textbook.weights[index]);
    }
    greatest
}
