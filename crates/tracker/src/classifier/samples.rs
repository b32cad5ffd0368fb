//! The training samples of a frame: the areas that were compared, as the discriminant scores them.
//!
//! A sample is the unit vector u = (x - origin) / ‖x - origin‖ of a feature vector x. It is not written out: its length
//! and its score follow from the inner products of x with the weights and with the origin, and sums over samples are
//! sums over vectors. A mean may be subtracted from the vectors, if it is subtracted from the origin as well.

use pulp::Simd;

use crate::linalg::gemm;
use crate::linalg::scratch::clear_and_reserve;
use crate::linalg::vector_ops;

/// Vectors of a sum that are worked on together, while they are in the cache.
const GROUP: usize = 8;

/// The origin, and of each sample its scale and its score.
#[derive(Debug, Default)]
pub(crate) struct TrainingSamples {
    /// The discriminant's weights, and its origin with the vectors' mean subtracted.
    weights: Vec<f32>,
    origin: Vec<f32>,
    /// 1 / ‖x - origin‖; 0 where the length is only rounding.
    scales: Vec<f32>,
    /// About 1 on the target and 0 beside it, but not bounded.
    pub scores: Vec<f32>,
    scratch: Vec<f32>,
}

impl TrainingSamples {
    /// Forgets the last samples and loads the discriminant's `weights` and `origin`, for vectors from which `mean` is
    /// subtracted (nothing, where it is empty); makes room for `max` samples.
    pub fn begin(&mut self, weights: &[f32], origin: &[f32], mean: &[f32], max: usize) {
        self.weights.clear();
        self.weights.extend_from_slice(weights);
        self.origin.clear();
        self.origin.extend_from_slice(origin);
        vector_ops::add(&mut self.origin, -1.0, mean);
        clear_and_reserve(&mut self.scales, max);
        clear_and_reserve(&mut self.scores, max);
    }

    /// The vectors whose products [`push_scores`](Self::push_scores) needs: the weights and the origin.
    pub fn query_vectors(&self) -> [&[f32]; 2] {
        [&self.weights, &self.origin]
    }

    /// Appends samples: their products with the weights and with the origin, and the squares of their vectors.
    pub fn push_scores(&mut self, [of_weights, of_origin]: [&[f32]; 2], squares: &[f32]) {
        let origin_score = vector_ops::dot(&self.origin, &self.weights);
        let origin_square = vector_ops::dot(&self.origin, &self.origin);
        let products = of_weights.iter().zip(of_origin);
        for ((of_weights, of_origin), square) in products.zip(squares) {
            let left = square + origin_square - 2.0 * of_origin;
            let is_left = left > (square + origin_square) * vector_ops::MIN_REMAINDER;
            let scale = if is_left { 1.0 / left.sqrt() } else { 0.0 };
            self.scales.push(scale);
            self.scores.push(scale * (of_weights - origin_score));
        }
    }

    /// As [`push_scores`](Self::push_scores), for `vectors` whose products and squares it computes.
    pub fn score_vectors(&mut self, vectors: &[f32]) {
        let len = self.weights.len();
        let count = vectors.len() / len;
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.clear();
        scratch.resize(3 * count, 0.0);
        let (products, squares) = scratch.split_at_mut(2 * count);
        let (of_weights, of_origin) = products.split_at_mut(count);
        gemm::inner_products(&self.weights, vectors, len, count, of_weights);
        gemm::inner_products(&self.origin, vectors, len, count, of_origin);
        for (square, vector) in squares.iter_mut().zip(vectors.chunks_exact(len)) {
            *square = vector_ops::dot(vector, vector);
        }
        self.push_scores([of_weights, of_origin], squares);
        self.scratch = scratch;
    }

    /// Forgets all samples but the first `count`.
    pub fn truncate(&mut self, count: usize) {
        self.scales.truncate(count);
        self.scores.truncate(count);
    }

    /// The vectors from the sample `first` on. In the last group the last vector fills the places that are left; the
    /// caller does not count those.
    #[inline(always)]
    fn group<'a>(&self, first: usize, vectors: &'a [f32], len: usize) -> [&'a [f32]; GROUP] {
        let mut group = [vectors; GROUP];
        for (i, vector) in group.iter_mut().enumerate() {
            *vector = &vectors[(first + i).min(self.scales.len() - 1) * len..][..len];
        }
        group
    }

    /// Σ (uᵢ · d)² over all samples, with d = `direction`.
    #[inline(always)]
    pub fn energy<S: Simd>(&self, simd: S, vectors: &[f32], direction: &[f32]) -> f32 {
        let (len, scales) = (direction.len(), &self.scales);
        let of_origin = vector_ops::dot(&self.origin, direction);
        let mut energy = 0.0;
        for first in (0..scales.len()).step_by(GROUP) {
            let products = gemm::tile(simd, self.group(first, vectors, len), [direction]);
            for ([product], scale) in products.iter().zip(&scales[first..]) {
                let product = scale * (product - of_origin);
                energy += product * product;
            }
        }
        energy
    }

    /// Adds Σ cᵢ uᵢ to `sum`.
    #[inline(always)]
    pub fn add_sum<S: Simd>(
        &self,
        simd: S,
        vectors: &[f32],
        coefficients: Coefficients<'_>,
        sum: &mut [f32],
    ) {
        let len = sum.len();
        let of_origin = match coefficients {
            Coefficients::Given(_) => 0.0,
            Coefficients::ProductsWith(direction) => vector_ops::dot(&self.origin, direction),
        };
        let count = self.scales.len();
        let mut total = 0.0;
        for first in (0..count).step_by(GROUP) {
            let group = self.group(first, vectors, len);
            let mut factors = [0.0; GROUP];
            let scales = &self.scales[first..];
            match coefficients {
                Coefficients::Given(given) => {
                    let counted = GROUP.min(count - first);
                    factors[..counted].copy_from_slice(&given[first..first + counted]);
                }
                Coefficients::ProductsWith(direction) => {
                    let products = gemm::tile(simd, group, [direction]);
                    for ((factor, [product]), scale) in factors.iter_mut().zip(products).zip(scales)
                    {
                        *factor = scale * (product - of_origin);
                    }
                }
            }
            for (factor, scale) in factors.iter_mut().zip(scales) {
                *factor *= scale;
                total += *factor;
            }
            vector_ops::add_all(simd, sum, factors, group);
        }
        vector_ops::add(sum, -total, &self.origin);
    }
}

/// The coefficients c of a sum over samples.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Coefficients<'a> {
    /// A coefficient for each sample.
    Given(&'a [f32]),
    /// uᵢ · d.
    ProductsWith(&'a [f32]),
}
