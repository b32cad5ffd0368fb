//! Soft binning: a row of gradients becomes a row of corners of the integral image.
//!
//! The strength of a gradient is shared between the two nearest directions, in proportion to its nearness to them.

use pulp::Simd;

use crate::features::hog::channels::{CHROMA, DIRECTIONS, GRAY, LANES, Lanes, registers};
use crate::features::hog::gradient::GradientRow;

/// The share of a gradient at `bin` that goes to a channel is max(0, slope · |bin - center| + top). That is a triangle
/// around the channel's own direction. The first direction is both 0 and 180 degrees: its share grows with the distance
/// from the middle bin.
const CENTERS: Lanes = {
    let mut centers = Lanes::single(0, DIRECTIONS as f32 / 2.0);
    let mut lane = 1;
    while lane < DIRECTIONS {
        centers.0[lane] = lane as f32;
        lane += 1;
    }
    centers
};
const SLOPES: Lanes = Lanes::directions(1.0, -1.0);
const TOPS: Lanes = Lanes::directions(1.0 - DIRECTIONS as f32 / 2.0, 1.0);
/// The share of a gray value that goes to a channel.
const GRAY_SHARES: Lanes = Lanes::single(GRAY, 1.0);
/// The shares of Cb and of Cr.
const CHROMA_SHARES: [Lanes; 2] = [Lanes::single(CHROMA[0], 1.0), Lanes::single(CHROMA[1], 1.0)];

/// Writes the sums at the corners `below` a row of pixels, one corner for every `SPACING` pixels. The channels of the
/// row's pixels up to a corner are added to the sum `above` it (`IS_FIRST`) or to the sum that is there already.
#[inline(always)]
pub(crate) fn sum_row<S: Simd, const SPACING: usize, const IS_FIRST: bool>(
    simd: S,
    row: &GradientRow,
    above: &[Lanes],
    below: &mut [Lanes],
) {
    let (centers, slopes, tops, gray_shares) = (CENTERS, SLOPES, TOPS, GRAY_SHARES);
    let (centers, slopes) = (centers.load::<S>(), slopes.load::<S>());
    let (tops, gray_shares) = (tops.load::<S>(), gray_shares.load::<S>());
    let [cb_shares, cr_shares] = CHROMA_SHARES;
    let (cb_shares, cr_shares) = (cb_shares.load::<S>(), cr_shares.load::<S>());
    let zero = simd.splat_f32s(0.0);
    let mut total = [zero; LANES];
    let (bins, _) = row.bins.as_chunks::<SPACING>();
    let (half_strengths, _) = row.half_strengths.as_chunks::<SPACING>();
    let (grays, _) = row.gray[1..].as_chunks::<SPACING>();
    let (cbs, _) = row.chroma[0].as_chunks::<SPACING>();
    let (crs, _) = row.chroma[1].as_chunks::<SPACING>();
    let pixels = bins
        .iter()
        .zip(half_strengths)
        .zip(grays)
        .zip(cbs.iter().zip(crs));
    let corners = above[1..].iter().zip(&mut below[1..]);
    for ((((bins, half_strengths), grays), (cbs, crs)), (above, below)) in pixels.zip(corners) {
        let (above, below) = (above.load::<S>(), below.load_mut::<S>());
        for register in 0..registers::<S>() {
            // Not added to `total` one by one, since each addition would wait for the one before.
            let mut sum = zero;
            for i in 0..SPACING {
                let bin = simd.splat_f32s(bins[i]);
                let distance = simd.abs_f32s(simd.sub_f32s(bin, centers[register]));
                let share = simd.mul_add_e_f32s(slopes[register], distance, tops[register]);
                // Registers of directions alone have no part in the other channels.
                if (register + 1) * S::F32_LANES > DIRECTIONS {
                    let gray = simd.splat_f32s(grays[i]);
                    let (cb, cr) = (simd.splat_f32s(cbs[i]), simd.splat_f32s(crs[i]));
                    sum = simd.mul_add_e_f32s(gray_shares[register], gray, sum);
                    sum = simd.mul_add_e_f32s(cb_shares[register], cb, sum);
                    sum = simd.mul_add_e_f32s(cr_shares[register], cr, sum);
                }
                // Twice max(share, 0), as WebAssembly has no quick maximum. The half of `half_strengths` undoes the
                // factor; both are exact.
                let share = simd.add_f32s(share, simd.abs_f32s(share));
                let half_strength = simd.splat_f32s(half_strengths[i]);
                sum = simd.mul_add_e_f32s(share, half_strength, sum);
            }
            total[register] = simd.add_f32s(total[register], sum);
            let before = if IS_FIRST {
                above[register]
            } else {
                below[register]
            };
            below[register] = simd.add_f32s(before, total[register]);
        }
    }
}
