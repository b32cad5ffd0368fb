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

/// Diagonalises [`LANES`] symmetric positive semidefinite matrices of size `dim`, each `dim * dim` in row order.
/// Their diagonals end as the eigenvalues, in no order. `vectors`, if given, ends with the eigenvector of the
/// `j`-th diagonal element in its `j`-th row.
pub(super) fn diagonalize(matrix: &mut [Lanes], dim: usize, mut vectors: Option<&mut [Lanes]>) {
    if let Some(vectors) = vectors.as_deref_mut() {
        vectors.fill([0.0; LANES]);
        for j in 0..dim {
            vectors[j * dim + j] = [1.0; LANES];
        }
    }
    let mut floor = [0.0; LANES];
    for j in 0..dim {
        for (sum, value) in floor.iter_mut().zip(&matrix[j * dim + j]) {
            *sum += value * NEGLIGIBLE;
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

#[inline]
fn turn(values: &mut [Lanes], p: usize, q: usize, cosine: &Lanes, sine: &Lanes) {
    let (at_p, at_q) = (values[p], values[q]);
    for lane in 0..LANES {
        values[p][lane] = cosine[lane] * at_p[lane] - sine[lane] * at_q[lane];
        values[q][lane] = sine[lane] * at_p[lane] + cosine[lane] * at_q[lane];
    }
}

/// Eigenvalues, largest first, and eigenvectors of one symmetric positive semidefinite matrix in row order.
pub(super) fn eigenpairs(matrix: &[f64], dim: usize) -> Vec<(f64, Vec<f64>)> {
    let mut lanes: Vec<Lanes> = matrix.iter().map(|&value| [value; LANES]).collect();
    let mut vectors = vec![[0.0; LANES]; dim * dim];
    diagonalize(&mut lanes, dim, Some(&mut vectors));
    let mut pairs: Vec<(f64, Vec<f64>)> = (0..dim)
        .map(|j| {
            let vector = (0..dim).map(|r| vectors[j * dim + r][0]).collect();
            (lanes[j * dim + j][0], vector)
        })
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs
}
