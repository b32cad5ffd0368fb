//! The patches of a frame by permutations, where the machine has AVX-512: a permutation looks up sixteen of 32 neighbouring pixels
//! in an instruction, where a load of sixteen words from anywhere takes as many loads.
//!
//! Pixels one above the other are brought together before they are looked up, which takes half of the loads and of the
//! permutations of looking up all four. Sixteen cells of a row are seldom more than 32 pixels wide; if they are, several
//! permutations are put together. The values are those of [`patch`](crate::tracker::features::gray::patch) to the last bit.

use std::arch::x86_64::{__m512, __m512i};
use std::ops::Range;

use pulp::{NullaryFnOnce, x86::V4};

use crate::tracker::features::gray::{Axis, MAX_CELLS, Region};
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;
use crate::tracker::params::table::Params;

/// Cells that are looked up together.
const LANES: usize = 16;

/// Pixels among which one permutation looks up.
const BOUNDS: usize = 2 * LANES;

/// Room after the last pixel: more than the look-ups in the longest row of pixels reach over its end.
const ROOM: usize =
    (crate::tracker::image::frame::WORKING_SIDE as usize).next_multiple_of(BOUNDS) + 2 * BOUNDS;

/// All cuts of a frame.
pub(crate) struct PermutedCuts<'a, A> {
    pub simd: V4,
    /// Room for the region's pixels, with one more column and one more row.
    pub pixels: &'a mut Vec<f32>,
    pub image: &'a GrayFrame,
    pub areas: A,
    pub params: &'a Params,
    pub out: &'a mut [f32],
}

/// Sixteen neighbouring cells of each row.
struct Block {
    /// The pixel at or before the first of them.
    first: usize,
    /// From there the pixel at or before each of them.
    at: [u32; LANES],
    /// The share of the pixel after that one.
    shares: [f32; LANES],
    /// How many times [`BOUNDS`] pixels they lie among, and whether they lie among the first [`LANES`].
    pieces: usize,
    is_narrow: bool,
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
        for (area, patch) in areas.zip(out.chunks_exact_mut(params.feature_len())) {
            let across = Axis::lay(area.x, area.width, params.patch_width, image.width());
            let down = Axis::lay(area.y, area.height, params.patch_height, image.height());
            let down = Rows {
                starts: &down
                    .first
                    .map(|row| row.wrapping_sub(region.top) as usize * width),
                shares: &down.share,
                pixels,
                width,
            };
            for index in 0..columns.div_ceil(LANES) {
                let block = Block::of(&across, index, columns, region.left);
                let cells = index * LANES..columns.min((index + 1) * LANES);
                match block.pieces {
                    _ if block.is_narrow => {
                        block.cut::<1, true>(simd, &down, patch, columns, cells);
                    }
                    1 => block.cut::<1, false>(simd, &down, patch, columns, cells),
                    2 => block.cut::<2, false>(simd, &down, patch, columns, cells),
                    _ => block.cut::<0, false>(simd, &down, patch, columns, cells),
                }
            }
        }
    }
}

/// The rows of cells of one area.
struct Rows<'a> {
    /// Where the row of pixels at or before the centres begins.
    starts: &'a [usize; MAX_CELLS],
    /// The share of the row after that one.
    shares: &'a [f32; MAX_CELLS],
    pixels: &'a [f32],
    width: usize,
}

impl Block {
    /// The `index`-th of a row of `columns` cells, in a region that begins at `left`.
    #[inline(always)]
    fn of(across: &Axis, index: usize, columns: usize, left: u32) -> Self {
        let cells = index * LANES;
        let last = (cells + LANES).min(columns) - 1;
        let first = across.first[cells];
        // The pixel after the last counts too.
        let radius = (across.first[last] - first + 1) as usize;
        let mut block = Self {
            first: (first - left) as usize,
            at: [0; LANES],
            shares: [0.0; LANES],
            pieces: radius / BOUNDS + 1,
            is_narrow: radius < LANES,
        };
        for lane in 0..LANES {
            block.at[lane] = across.first[cells + lane].wrapping_sub(first);
            block.shares[lane] = across.share[cells + lane];
        }
        block
    }

    /// Cuts the columns `cells` of all rows of `patch`. `PIECES` is the number of pieces, or 0 for any; of a narrow block
    /// `IS_NARROW`.
    #[inline(always)]
    fn cut<const PIECES: usize, const IS_NARROW: bool>(
        &self,
        simd: V4,
        down: &Rows<'_>,
        patch: &mut [f32],
        columns: usize,
        cells: Range<usize>,
    ) {
        let x = simd.avx512f;
        let left: __m512i = pulp::cast(self.at);
        let right = x._mm512_add_epi32(left, x._mm512_set1_epi32(1));
        let shares: __m512 = pulp::cast(self.shares);
        let pieces = if PIECES > 0 { PIECES } else { self.pieces };
        let rows = down.starts.iter().zip(down.shares);
        for (target, (&start, &share)) in patch.chunks_exact_mut(columns).zip(rows) {
            let upper = &down.pixels[start + self.first..];
            let lower = &upper[down.width..];
            let rows = Pair {
                upper,
                lower,
                share: x._mm512_set1_ps(share),
            };
            let [before, after] = if IS_NARROW {
                let pixels = rows.between(simd, 0);
                [
                    x._mm512_permutexvar_ps(left, pixels),
                    x._mm512_permutexvar_ps(right, pixels),
                ]
            } else {
                rows.look_up(simd, left, right, pieces)
            };
            let gray = between(simd, before, after, shares);
            let gray = x._mm512_mul_ps(gray, x._mm512_set1_ps(1.0 / 255.0));
            let gray = x._mm512_min_ps(gray, x._mm512_set1_ps(1.0));
            let target = &mut target[cells.clone()];
            match target.as_mut_array::<LANES>() {
                Some(target) => *target = pulp::cast(gray),
                None => {
                    let values: [f32; LANES] = pulp::cast(gray);
                    target.copy_from_slice(&values[..target.len()]);
                }
            }
        }
    }
}

/// `a + (b - a) * share`, each operation rounded.
#[inline(always)]
fn between(simd: V4, a: __m512, b: __m512, share: __m512) -> __m512 {
    let difference = simd.avx512f._mm512_sub_ps(b, a);
    let part = simd.avx512f._mm512_mul_ps(difference, share);
    simd.avx512f._mm512_add_ps(a, part)
}

/// Two rows of pixels, one above the other, and the share of the lower.
struct Pair<'a> {
    upper: &'a [f32],
    lower: &'a [f32],
    share: __m512,
}

impl Pair<'_> {
    /// Between the sixteen pixels of each from `first` on.
    #[inline(always)]
    fn between(&self, simd: V4, first: usize) -> __m512 {
        let (upper, lower) = (load(&self.upper[first..]), load(&self.lower[first..]));
        between(simd, upper, lower, self.share)
    }

    /// What is between the rows at the places `left` and at the places `right`, which lie among so many `pieces`.
    #[inline(always)]
    fn look_up(&self, simd: V4, left: __m512i, right: __m512i, pieces: usize) -> [__m512; 2] {
        let x = simd.avx512f;
        let [mut before, mut after] = self.look_up_near(simd, left, right, 0);
        for index in 1..pieces {
            // A permutation looks at the five low bits of a place.
            let further = self.look_up_near(simd, left, right, index * BOUNDS);
            let least = x._mm512_set1_epi32((index * BOUNDS) as i32);
            let is_further = x._mm512_cmpge_epi32_mask(left, least);
            before = x._mm512_mask_blend_ps(is_further, before, further[0]);
            let is_further = x._mm512_cmpge_epi32_mask(right, least);
            after = x._mm512_mask_blend_ps(is_further, after, further[1]);
        }
        [before, after]
    }

    #[inline(always)]
    fn look_up_near(&self, simd: V4, left: __m512i, right: __m512i, from: usize) -> [__m512; 2] {
        let (first, second) = (self.between(simd, from), self.between(simd, from + LANES));
        let x = simd.avx512f;
        [
            x._mm512_permutex2var_ps(first, left, second),
            x._mm512_permutex2var_ps(first, right, second),
        ]
    }
}

#[inline(always)]
fn load(pixels: &[f32]) -> __m512 {
    let pixels: &[f32; LANES] = pixels
        .first_chunk()
        .expect("a window of scratch after the last pixel");
    pulp::cast(*pixels)
}

/// Copies the pixels of the region, the last column and the last row once more, and room for a look-up at the end.
#[inline(always)]
fn fill(region: &Region, image: &GrayFrame, pixels: &mut Vec<f32>) {
    let (image_width, image_height) = (image.width() as usize, image.height() as usize);
    // Room for all of the image at once, so that a region that grows allocates nothing.
    let most = (image_width + 1) * (image_height + 1) + ROOM;
    pixels.reserve(most.saturating_sub(pixels.len()));
    let width = region.width + 1;
    pixels.resize(width * (region.height + 1) + ROOM, 0.0);
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
