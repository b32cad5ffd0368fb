//! Eigenvalues of many tiny symmetric matrices at once.
//!
//! A frame needs some hundred problems of size P + 1 and a thousand of size n. One Jacobi rotation is a chain of a
//! division and two square roots that the processor spends waiting; with [`LANES`] problems side by side the
//! waiting is shared, and the compiler turns each line into vector instructions. Jacobi is also what loses fewest
//! digits on positive semidefinite matrices, and it cannot fail to converge.

/// How many matrices are diagonalised together.
pub(super) const LANES: usize = 8;

/// One matrix element of each of the [`LANES`] problems.
pub(super) type Lanes = [f64; LANES];

/// Cyclic Jacobi needs four to six sweeps at these sizes; the bound only guards against a NaN.
const MAX_SWEEPS: usize = 16;

/// An off-diagonal element below this share of the trace is rounding.
const NEGLIGIBLE: f64 = 1e-16;

/// The same where no eigenvectors are wanted: leaving out an element changes an eigenvalue by its square over a gap, and
/// by the element itself at most.
const NEGLIGIBLE_FOR_VALUES: f64 = 1e-13;

/// Diagonalises [`LANES`] symmetric positive semidefinite matrices of size `dim`, each `dim * dim` in row order.
/// Their diagonals end as the eigenvalues, in no order. `vectors`, if given, ends with the eigenvector of the
/// `j`-th diagonal element in its `j`-th row.
#[inline(always)]
pub(super) fn diagonalize(matrix: &mut [Lanes], dim: usize, mut vectors: Option<&mut [Lanes]>) {
    let negligible = match vectors {
        Some(_) => NEGLIGIBLE,
        None => NEGLIGIBLE_FOR_VALUES,
    };
    if let Some(vectors) = vectors.as_deref_mut() {
        vectors.fill([0.0; LANES]);
        for j in 0..dim {
            vectors[j * dim + j] = [1.0; LANES];
        }
    }
    let mut floor = [0.0; LANES];
    for j in 0..dim {
        for (sum, value) in floor.iter_mut().zip(&matrix[j * dim + j]) {
            *sum += value * negligible;
        }
    }
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..dim {
            for q in p + 1..dim {
                let off = &matrix[p * dim + q];
                if (0..LANES).all(|lane| off[lane].abs() <= floor[lane]) {
                    continue;
                }
                rotated = true;
                rotate(matrix, dim, p, q, vectors.as_deref_mut());
            }
        }
        if !rotated {
            break;
        }
    }
}

/// Zeroes element (p, q) of every lane, p < q. Only the upper triangle is read and written.
#[inline(always)]
fn rotate(matrix: &mut [Lanes], dim: usize, p: usize, q: usize, vectors: Option<&mut [Lanes]>) {
    let (pp, qq, pq) = (p * dim + p, q * dim + q, p * dim + q);
    let (diagonal_p, diagonal_q, off) = (matrix[pp], matrix[qq], matrix[pq]);
    let (mut sine, mut cosine) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let gap = diagonal_q[lane] - diagonal_p[lane];
        let twice = 2.0 * off[lane];
        // The smaller root, without a branch; MIN_POSITIVE keeps 0 / 0 out where there is nothing to rotate.
        let root = (gap * gap + twice * twice).sqrt() + gap.abs() + f64::MIN_POSITIVE;
        let tangent = twice * 1.0_f64.copysign(gap) / root;
        let inverse = 1.0 / (tangent * tangent + 1.0).sqrt();
        cosine[lane] = inverse;
        sine[lane] = tangent * inverse;
        matrix[pp][lane] -= tangent * off[lane];
        matrix[qq][lane] += tangent * off[lane];
        matrix[pq][lane] = 0.0;
    }
    for r in (0..dim).filter(|&r| r != p && r != q) {
        let rp = r.min(p) * dim + r.max(p);
        let rq = r.min(q) * dim + r.max(q);
        turn(matrix, rp, rq, &cosine, &sine);
    }
    if let Some(vectors) = vectors {
        for r in 0..dim {
            turn(vectors, p * dim + r, q * dim + r, &cosine, &sine);
        }
    }
}

#[inline(always)]
fn turn(values: &mut [Lanes], p: usize, q: usize, cosine: &Lanes, sine: &Lanes) {
    let (at_p, at_q) = (values[p], values[q]);
    for lane in 0..LANES {
        values[p][lane] = cosine[lane] * at_p[lane] - sine[lane] * at_q[lane];
        values[q][lane] = sine[lane] * at_p[lane] + cosine[lane] * at_q[lane];
    }
}

/// The eigenvalues, largest first, and eigenvectors of one symmetric positive semidefinite matrix; keeps its room.
#[derive(Debug, Clone, Default)]
pub(super) struct Spectrum {
    dim: usize,
    matrix: Vec<Lanes>,
    vectors: Vec<Lanes>,
    /// From the place among the eigenvalues to that on the diagonal.
    order: Vec<usize>,
}

impl Spectrum {
    /// Solves the matrix of `dim` rows whose element (i, j), j >= i, is `element(i, j)`.
    #[inline(always)]
    pub fn solve(&mut self, dim: usize, element: impl Fn(usize, usize) -> f64) {
        self.dim = dim;
        self.matrix.clear();
        self.matrix.resize(dim * dim, [0.0; LANES]);
        self.vectors.resize(dim * dim, [0.0; LANES]);
        for i in 0..dim {
            for j in i..dim {
                self.matrix[i * dim + j] = [element(i, j); LANES];
            }
        }
        diagonalize(&mut self.matrix, dim, Some(&mut self.vectors));
        self.order.clear();
        self.order.extend(0..dim);
        let value = |j: usize| self.matrix[j * dim + j][0];
        self.order
            .sort_unstable_by(|&a, &b| value(b).total_cmp(&value(a)).then(a.cmp(&b)));
    }

    /// The eigenvalues, largest first.
    pub fn values(&self) -> impl Iterator<Item = f64> {
        self.order.iter().map(|&j| self.matrix[j * self.dim + j][0])
    }

    /// Component `index` of the eigenvector of the eigenvalue at `place`.
    pub fn weight(&self, place: usize, index: usize) -> f64 {
        self.vectors[self.order[place] * self.dim + index][0]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    fn eigenpairs(matrix: &[f64], dim: usize) -> Vec<(f64, Vec<f64>)> {
        let mut spectrum = Spectrum::default();
        spectrum.solve(dim, |i, j| matrix[i * dim + j]);
        let values = spectrum.values().enumerate();
        values
            .map(|(place, value)| (value, (0..dim).map(|i| spectrum.weight(place, i)).collect()))
            .collect()
    }

    /// A positive semidefinite matrix of some rank, with eigenvalues of very different sizes.
    fn matrix(dim: usize, rank: usize, seed: usize) -> DMatrix<f64> {
        let factor = DMatrix::from_fn(dim, rank, |i, j| {
            let hash = (i * 37 + j * 101 + seed * 53) % 97;
            (hash as f64 / 97.0 - 0.5) * 10_f64.powi(-(j as i32))
        });
        &factor * factor.transpose()
    }

    #[test]
    fn eigenpairs_rebuild_the_matrix() {
        for dim in 1..=11 {
            for rank in 1..=dim {
                let expected = matrix(dim, rank, dim);
                let pairs = eigenpairs(expected.as_slice(), dim);
                let mut rebuilt = DMatrix::zeros(dim, dim);
                for (value, vector) in &pairs {
                    let vector = DMatrix::from_column_slice(dim, 1, vector);
                    assert!((vector.norm() - 1.0).abs() < 1e-12);
                    rebuilt += &vector * vector.transpose() * *value;
                }
                assert!((rebuilt - &expected).norm() < 1e-13 * expected.norm().max(1e-300));
                assert!(pairs.windows(2).all(|pair| pair[0].0 >= pair[1].0));
            }
        }
    }

    #[test]
    fn lanes_do_not_mix() {
        let dim = 4;
        let matrices: Vec<DMatrix<f64>> = (0..LANES).map(|lane| matrix(dim, 4, lane)).collect();
        let mut lanes: Vec<Lanes> = (0..dim * dim)
            .map(|i| std::array::from_fn(|lane| matrices[lane].as_slice()[i]))
            .collect();
        diagonalize(&mut lanes, dim, None);
        for (lane, matrix) in matrices.iter().enumerate() {
            let mut values: Vec<f64> = (0..dim).map(|j| lanes[j * dim + j][lane]).collect();
            values.sort_by(|a, b| b.total_cmp(a));
            for (value, (expected, _)) in values.iter().zip(eigenpairs(matrix.as_slice(), dim)) {
                assert!((value - expected).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn nothing_becomes_nan() {
        for value in [0.0, 1.0, 1e-300, 1e8] {
            for (eigenvalue, vector) in eigenpairs(&[value; 9], 3) {
                assert!(eigenvalue.is_finite() && vector.iter().all(|v| v.is_finite()));
            }
        }
    }
}
