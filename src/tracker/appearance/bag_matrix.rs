//! What the single-vector candidates of a frame are multiplied by, as the rows of one matrix: the background's samples,
//! for each entry of the bag its mean and basis vectors, and the vectors that the discriminant asks for.

use pulp::{Arch, Simd};

use crate::tracker::appearance::background::Background;
use crate::tracker::appearance::bag::Bag;
use crate::tracker::linalg::scratch::AlignedBuffer;

/// The rows, each of length D, and what is known of them beside.
#[derive(Debug, Default)]
pub(crate) struct BagMatrix {
    values: AlignedBuffer,
    /// The templates of an entry.
    templates: Vec<f32>,
    /// The number of samples, and L⁻¹ of the metric.
    pub samples: usize,
    pub inverse: Vec<f32>,
    /// ‖μₖ‖² and the number of basis vectors of each entry.
    pub entries: Vec<(f64, usize)>,
    /// For each mean and basis vector its background coordinates.
    pub background_coordinates: Vec<f32>,
}

#[pulp::with_simd(load = Arch::new())]
#[inline(always)]
fn load_simd<S: Simd>(
    simd: S,
    matrix: &mut BagMatrix,
    bag: &Bag,
    background: &Background,
    queries: [&[f32]; 2],
    len: usize,
) {
    matrix.load_all(simd, bag, background, queries, len);
}

impl BagMatrix {
    /// Loads the bag and the background's metric, for vectors of length `len`, and two vectors whose products are
    /// asked for as well (each of that length, or empty).
    pub fn load(&mut self, bag: &Bag, background: &Background, queries: [&[f32]; 2], len: usize) {
        load(self, bag, background, queries, len);
    }

    #[inline(always)]
    fn load_all<S: Simd>(
        &mut self,
        simd: S,
        bag: &Bag,
        background: &Background,
        queries: [&[f32]; 2],
        len: usize,
    ) {
        self.samples = background.metric().count();
        self.inverse.clear();
        self.inverse
            .extend_from_slice(background.metric().inverse());
        self.entries.clear();
        let entries = bag.entries();
        self.entries
            .extend(entries.iter().map(|entry| entry.span().0.size()));
        let count = self.samples + self.subspace_rows() + queries.len();
        self.values.resize(count * len);
        let (samples, mut rest) = self.values.values_mut().split_at_mut(self.samples * len);
        background.write_samples(samples);
        self.background_coordinates.clear();
        for (entry, (_, dim)) in entries.iter().zip(&self.entries) {
            let (span, templates) = entry.span();
            let (rows, others) = rest.split_at_mut((1 + dim) * len);
            span.write_to(simd, templates, background, &mut self.templates, rows);
            self.background_coordinates
                .extend_from_slice(span.background_coordinates());
            rest = others;
        }
        for (row, query) in rest.chunks_exact_mut(len).zip(queries) {
            row[..query.len()].copy_from_slice(query);
        }
    }

    /// The rows, one after the other.
    #[inline(always)]
    pub fn rows(&self) -> &[f32] {
        self.values.values()
    }

    /// The number of means and basis vectors.
    #[inline(always)]
    pub fn subspace_rows(&self) -> usize {
        self.entries.iter().map(|(_, dim)| 1 + dim).sum()
    }
}
