//! The score of a window from its sums: the discriminant's score of the unit vector of its features.

use pulp::Simd;

use crate::classifier::ridge::Discriminant;
use crate::features::hog::cells::MIN_CONTRAST;
use crate::features::hog::channels::{CHANNELS, GRAY, GRAY_WEIGHT};
use crate::linalg::vector_ops;

/// What the scores of a frame have in common.
pub(crate) struct Scorer {
    /// The sums of the gray channel of the weights and of the origin.
    grays: [f32; 2],
    /// w · origin and ‖origin‖².
    origin_score: f32,
    origin_square: f32,
    /// Cells of a window.
    count: f32,
    min_deviation: f32,
}

impl Scorer {
    #[inline(always)]
    pub fn new(discriminant: &Discriminant, cell_pixels: f32) -> Self {
        let Discriminant { weights, origin } = discriminant;
        let grays = |vector: &[f32]| -> f32 {
            let cells = vector.as_chunks::<CHANNELS>().0.iter();
            cells.map(|cell| cell[GRAY]).sum()
        };
        Self {
            grays: [grays(weights), grays(origin)],
            origin_score: vector_ops::dot(weights, origin),
            origin_square: vector_ops::dot(origin, origin),
            count: (weights.len() / CHANNELS) as f32,
            min_deviation: MIN_CONTRAST * cell_pixels,
        }
    }

    /// The scores of windows, one a lane. `whole` are the windows' products with the weights and with the origin, over
    /// all channels but the gray one; `grays` are these products of the gray values as they are on the grid. The last
    /// argument is the windows' sums of energies, of gray values and of squares of gray values.
    #[inline(always)]
    pub fn score<S: Simd>(
        &self,
        simd: S,
        [mut whole, grays]: [[S::f32s; 2]; 2],
        [energy, gray, square]: [S::f32s; 3],
    ) -> S::f32s {
        let zero = simd.splat_f32s(0.0);
        let (count, share) = (
            simd.splat_f32s(self.count),
            simd.splat_f32s(1.0 / self.count),
        );
        // The gray values of a window have its own mean subtracted and are divided by its own deviation.
        let mean = simd.mul_f32s(gray, share);
        let variance = simd.sub_f32s(simd.mul_f32s(square, share), simd.mul_f32s(mean, mean));
        let variance = simd.max_f32s(variance, zero);
        let min_deviation = simd.splat_f32s(self.min_deviation);
        let deviation = simd.max_f32s(simd.sqrt_f32s(variance), min_deviation);
        let scale = simd.div_f32s(simd.splat_f32s(GRAY_WEIGHT), deviation);
        for ((whole, grays), sum) in whole.iter_mut().zip(grays).zip(self.grays) {
            let shift = simd.mul_f32s(mean, simd.splat_f32s(sum));
            *whole = simd.mul_add_e_f32s(scale, simd.sub_f32s(grays, shift), *whole);
        }
        let [of_weights, of_origin] = whole;
        let contrast = simd.mul_f32s(simd.mul_f32s(scale, scale), variance);
        let square = simd.mul_add_e_f32s(contrast, count, energy);
        let both = simd.add_f32s(square, simd.splat_f32s(self.origin_square));
        let left = simd.sub_f32s(both, simd.add_f32s(of_origin, of_origin));
        let is_left = simd.less_than_f32s(
            simd.mul_f32s(both, simd.splat_f32s(vector_ops::MIN_REMAINDER)),
            left,
        );
        let above = simd.sub_f32s(of_weights, simd.splat_f32s(self.origin_score));
        let score = simd.div_f32s(above, simd.sqrt_f32s(left));
        simd.select_f32s(is_left, score, zero)
    }
}
