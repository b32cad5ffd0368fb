//! The patches of a frame by permutations, where the machine has AVX-512: a permutation looks up sixteen of 32 neighbouring pixels
//! in an instruction, where a load of sixteen words from anywhere takes as many loads.
//!
//! Sixteen cells of a row are seldom more than 32 pixels wide; if they are, several permutations are put together. The
//! values are those of [`patch`](super::patch) to the last bit.

use std::arch::x86_64::{__m512, __m512i};

use pulp::{NullaryFnOnce, x86::V4};

use super::patch::{Axis, MOST_CELLS, Region};
use super::{GrayFrame, Params, Rect};

/// Cells that are looked up together.
const LANES: usize = 16;

/// Pixels among which one permutation looks up.
const REACH: usize = 2 * LANES;

/// Most permutations for one look-up; enough for the longest row of pixels.
const MOST: usize = super::WORKING_SIDE as usize / REACH + 2;

/// All cuts of a frame.
pub(super) struct PermutedCuts<'a, A> {
    pub simd: V4,
    /// Room for the region's pixels, with one more column and one more row.
    pub pixels: &'a mut Vec<f32>,
    pub image: &'a GrayFrame,
    pub areas: A,
    pub params: &'a Params,
    pub out: &'a mut [f32],
}

/// Sixteen neighbouring cells of each row.
#[derive(Clone, Copy)]
struct Block {
    /// The pixel at or before the first of them.
    first: usize,
    /// From there the pixel at or before each of them.
    at: [u32; LANES],
    /// The share of the pixel after that one.
    shares: [f32; LANES],
    /// How many times [`REACH`] pixels they lie among.
    pieces: usize,
}

impl<A: Iterator<Item = Rect> + Clone> NullaryFnOnce for PermutedCuts<'_, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            simd,
            pixels,
            image,
            areas,
            params,
            out,
        } = self;
        let region = Region::around(image, areas.clone());
        let width = region.width + 1;
        fill(&region, image, pixels);
        let columns = params.patch_width as usize;
        let mut blocks = [Block {
            first: 0,
            at: [0; LANES],
            shares: [0.0; LANES],
            pieces: 0,
        }; MOST_CELLS / LANES];
        for (area, patch) in areas.zip(out.chunks_exact_mut(params.feature_len())) {
            let across = Axis::lay(area.x, area.width, params.patch_width, image.width());
            let down = Axis::lay(area.y, area.height, params.patch_height, image.height());
            for (index, block) in blocks[..columns.div_ceil(LANES)].iter_mut().enumerate() {
                *block = Block::of(&across, index, columns, region.left);
            }
            let rows = down.first.iter().zip(&down.share);
            for (target, (&row, &share)) in patch.chunks_exact_mut(columns).zip(rows) {
                let upper = &pixels[(row - region.top) as usize * width..];
                let lower = &upper[width..];
                for (target, block) in target.chunks_mut(LANES).zip(&blocks) {
                    let values = block.cut(simd, upper, lower, share);
                    match target.as_mut_array::<LANES>() {
                        Some(target) => *target = values,
                        None => target.copy_from_slice(&values[..target.len()]),
                    }
                }
            }
        }
    }
}

impl Block {
    /// The `index`-th of a row of `columns` cells, in a region that begins at `left`.
    #[inline(always)]
    fn of(across: &Axis, index: usize, columns: usize, left: u32) -> Self {
        let cells = index * LANES;
        let last = (cells + LANES).min(columns) - 1;
        let first = across.first[cells];
        let mut block = Self {
            first: (first - left) as usize,
            at: [0; LANES],
            shares: [0.0; LANES],
            // The pixel after the last counts too.
            pieces: (across.first[last] - first) as usize / REACH + 1,
        };
        if (across.first[last] - first) as usize % REACH == REACH - 1 {
            block.pieces += 1;
        }
        for lane in 0..LANES {
            block.at[lane] = across.first[cells + lane].wrapping_sub(first);
            block.shares[lane] = across.share[cells + lane];
        }
        block
    }

    /// The cells between two rows of pixels, `share` being that of the lower one.
    #[inline(always)]
    fn cut(&self, simd: V4, upper: &[f32], lower: &[f32], share: f32) -> [f32; LANES] {
        let x = simd.avx512f;
        let left: __m512i = pulp::cast(self.at);
        let right = x._mm512_add_epi32(left, x._mm512_set1_epi32(1));
        let (upper, lower) = (&upper[self.first..], &lower[self.first..]);
        let [a, b, c, d] = if self.pieces == 1 {
            let (upper, lower) = (Piece::of(upper, 0), Piece::of(lower, 0));
            [
                upper.look_up(simd, left),
                upper.look_up(simd, right),
                lower.look_up(simd, left),
                lower.look_up(simd, right),
            ]
        } else {
            [
                look_up_far(simd, upper, left, self.pieces),
                look_up_far(simd, upper, right, self.pieces),
                look_up_far(simd, lower, left, self.pieces),
                look_up_far(simd, lower, right, self.pieces),
            ]
        };
        let share = x._mm512_set1_ps(share);
        let left = between(simd, a, c, share);
        let right = between(simd, b, d, share);
        let gray = between(simd, left, right, pulp::cast(self.shares));
        let gray = x._mm512_mul_ps(gray, x._mm512_set1_ps(1.0 / 255.0));
        pulp::cast(x._mm512_min_ps(gray, x._mm512_set1_ps(1.0)))
    }
}

/// `a + (b - a) * share`, each operation rounded.
#[inline(always)]
fn between(simd: V4, a: __m512, b: __m512, share: __m512) -> __m512 {
    let difference = simd.avx512f._mm512_sub_ps(b, a);
    let part = simd.avx512f._mm512_mul_ps(difference, share);
    simd.avx512f._mm512_add_ps(a, part)
}

/// [`REACH`] pixels.
struct Piece([__m512; 2]);

impl Piece {
    #[inline(always)]
    fn of(row: &[f32], index: usize) -> Self {
        let pixels: &[f32; REACH] = row[index * REACH..]
            .first_chunk()
            .expect("a window of room after the last pixel");
        let (halves, _) = pixels.as_chunks::<LANES>();
        Self([pulp::cast(halves[0]), pulp::cast(halves[1])])
    }

    /// The pixels whose places are in the five low bits of `at`.
    #[inline(always)]
    fn look_up(&self, simd: V4, at: __m512i) -> __m512 {
        simd.avx512f._mm512_permutex2var_ps(self.0[0], at, self.0[1])
    }
}

/// The pixels of `row` at the places `at`, which lie among as many `pieces`.
#[inline(always)]
fn look_up_far(simd: V4, row: &[f32], at: __m512i, pieces: usize) -> __m512 {
    let mut pixels = Piece::of(row, 0).look_up(simd, at);
    for index in 1..pieces.min(MOST) {
        let further = Piece::of(row, index).look_up(simd, at);
        let least = simd.avx512f._mm512_set1_epi32((index * REACH) as i32);
        let is_further = simd.avx512f._mm512_cmpge_epi32_mask(at, least);
        pixels = simd.avx512f._mm512_mask_blend_ps(is_further, pixels, further);
    }
    pixels
}

/// Copies the pixels of the region, the last column and the last row once more, and room for a look-up at the end.
#[inline(always)]
fn fill(region: &Region, image: &GrayFrame, pixels: &mut Vec<f32>) {
    let (image_width, image_height) = (image.width() as usize, image.height() as usize);
    // Room for all of the image at once, so that a region that grows allocates nothing.
    let room = MOST * REACH;
    let most = (image_width + 1) * (image_height + 1) + room;
    pixels.reserve(most.saturating_sub(pixels.len()));
    let width = region.width + 1;
    pixels.resize(width * (region.height + 1) + room, 0.0);
    let left = region.left as usize;
    // The last column of the image has no right neighbour.
    let inner = width.min(image_width - left);
    let rows = pixels.chunks_exact_mut(width).take(region.height + 1);
    for (y, row) in (region.top as usize..).zip(rows) {
        let from = y.min(image_height - 1) * image_width + left;
        let values = &image.pixels()[from..from + inner];
        for (pixel, &value) in row.iter_mut().zip(values) {
            *pixel = f32::from(value);
        }
        if let Some(last) = row.get_mut(inner) {
            *last = f32::from(values[inner - 1]);
        }
    }
}
