//! What the single-vector candidates of a frame are multiplied by, as the rows of one matrix: the background's samples,
//! for each entry of the bag its mean and basis vectors, and the vectors that the discriminant asks for.

use pulp::{Arch, Simd};

use crate::appearance::background::Background;
use crate::appearance::bag::Bag;
use crate::appearance::span::Span;
use crate::linalg::fixed_point::FixedPoint;

/// The rows, each of length D, and what the distances need besides the products with the rows.
#[derive(Debug, Default)]
pub(crate) struct BagMatrix {
    pub rows: FixedPoint,
    /// Buffer: the rows in single precision.
    values: Vec<f32>,
    /// Buffer: the templates of an entry.
    templates: Vec<f32>,
    /// The number of samples, and L⁻¹ of the metric.
    pub samples: usize,
    pub inverse: Vec<f32>,
    /// ‖μₖ‖² and the number of basis vectors of each entry.
    pub entries: Vec<(f64, usize)>,
    /// For each mean and basis vector its background coordinates.
    pub background_coordinates: Vec<f32>,
}

/// Loads the bag and the background's metric, for vectors of length `len`. `queries` are two more vectors whose
/// products with the candidates are wanted, each of that length or empty.
#[pulp::with_simd(load = Arch::new())]
#[inline(always)]
pub(crate) fn load_simd<S: Simd>(
    simd: S,
    matrix: &mut BagMatrix,
    bag: &Bag<Span>,
    background: &Background,
    queries: [&[f32]; 2],
    len: usize,
) {
    let (metric, entries) = (&background.metric, &bag.entries);
    matrix.samples = metric.count;
    matrix.inverse.clone_from(&metric.inverse);
    matrix.entries.clear();
    let sizes = entries.iter().map(|entry| (entry.norm, entry.dim));
    matrix.entries.extend(sizes);
    let count = matrix.samples + matrix.subspace_rows() + queries.len();
    matrix.values.resize(count * len, 0.0);
    let (samples, mut rest) = matrix.values.split_at_mut(metric.count * len);
    background.write_samples(samples);
    matrix.background_coordinates.clear();
    for span in entries {
        let (rows, others) = rest.split_at_mut((1 + span.dim) * len);
        span.write_to(simd, background, &mut matrix.templates, rows);
        let coordinates = &span.background_coordinates;
        matrix.background_coordinates.extend_from_slice(coordinates);
        rest = others;
    }
    for (row, query) in rest.chunks_exact_mut(len).zip(queries) {
        row[..query.len()].copy_from_slice(query);
    }
    matrix.rows.set(&matrix.values, len);
}

impl BagMatrix {
    /// The number of means and basis vectors.
    #[inline(always)]
    pub fn subspace_rows(&self) -> usize {
        self.entries.iter().map(|(_, dim)| 1 + dim).sum()
    }
}
