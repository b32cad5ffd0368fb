//! From a candidate area to its feature vector: the one place that knows what the tracker looks at.
//!
//! The area is resized to H₁ x H₂ by bilinear interpolation at the centres of its cells and taken row by row, as
//! gray values in [0, 1] (section III-B). Outside the frame the nearest edge pixel counts.

#[cfg(target_arch = "x86_64")]
use pulp::x86::V4;
use pulp::{Arch, Simd, WithSimd};

#[cfg(target_arch = "x86_64")]
use crate::tracker::features::gray_avx512::PermutedCuts;
use crate::tracker::image::frame::GrayFrame;
use crate::tracker::image::rect::Rect;
use crate::tracker::params::table::Params;

/// How many columns are worked on together.
const BLOCK: usize = 16;

/// Most rows or columns of cells; whole blocks.
pub(crate) const MAX_CELLS: usize = 64;

/// More than the quads of a row; a power of two, so that a masked index needs no check.
const WINDOW: usize = 512;
const _: () = assert!((crate::tracker::image::frame::WORKING_SIDE as usize) < WINDOW);

/// Cuts the patches of many areas out of one frame; keeps its buffers from one frame to the next.
///
/// This took as long as everything else that a step does. So the four pixels between which a cell lies are one 32-bit
/// word, a *quad*, made once a frame for all areas; a cell is then one load, and the rest is vector instructions.
#[derive(Debug, Clone, Default)]
pub(crate) struct GrayPatches {
    /// For each pixel of the region row by row: itself, the one right of it, and the two below these, lowest byte first.
    quads: Vec<u32>,
    /// The pixels of the region, where patches are cut by permutations.
    #[cfg(target_arch = "x86_64")]
    pixels: Vec<f32>,
}

/// For each cell along one axis, the pixel at or before its centre, and the share of the pixel after that one.
pub(crate) struct Axis {
    pub first: [u32; MAX_CELLS],
    pub share: [f32; MAX_CELLS],
}

/// The pixels at or after which cells can lie: from (`left`, `top`), `width` a row, `height` rows.
pub(crate) struct Region {
    pub left: u32,
    pub top: u32,
    pub width: usize,
    pub height: usize,
}

/// All cuts of a frame, to be compiled for the instructions that this machine has.
struct Cuts<'a, A> {
    quads: &'a mut Vec<u32>,
    image: &'a GrayFrame,
    areas: A,
    params: &'a Params,
    out: &'a mut [f32],
}

impl GrayPatches {
    /// Writes the feature vectors of `areas` (working pixels, finite, sides above 0) to `out`, D values for each.
    pub fn cut<A: Iterator<Item = Rect> + Clone>(
        &mut self,
        image: &GrayFrame,
        areas: A,
        params: &Params,
        out: &mut [f32],
    ) {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = V4::try_new() {
            return simd.vectorize(PermutedCuts {
                simd,
                pixels: &mut self.pixels,
                image,
                areas,
                params,
                out,
            });
        }
        Arch::new().dispatch(self.cuts(image, areas, params, out));
    }

    /// All cuts of a frame for any machine.
    fn cuts<'a, A>(
        &'a mut self,
        image: &'a GrayFrame,
        areas: A,
        params: &'a Params,
        out: &'a mut [f32],
    ) -> Cuts<'a, A> {
        Cuts {
            quads: &mut self.quads,
            image,
            areas,
            params,
            out,
        }
    }
}

impl<A: Iterator<Item = Rect> + Clone> WithSimd for Cuts<'_, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            quads,
            image,
            areas,
            params,
            out,
        } = self;
        let region = Region::around(image, areas.clone());
        region.fill(image, quads);
        let columns = params.patch_width as usize;
        for (area, patch) in areas.zip(out.chunks_exact_mut(params.feature_len())) {
            let across = Axis::lay(area.x, area.width, params.patch_width, image.width());
            let down = Axis::lay(area.y, area.height, params.patch_height, image.height());
            let at = across.first.map(|first| first.wrapping_sub(region.left));
            let rows = down.first.iter().zip(&down.share);
            for (target, (&row, &share)) in patch.chunks_exact_mut(columns).zip(rows) {
                let start = (row - region.top) as usize * region.width;
                let row = quads[start..]
                    .first_chunk()
                    .expect("a window of scratch after the last quad");
                cut_row(row, &at, &across.share, share, target);
            }
        }
    }
}

/// One row of cells: `at` and `shares` by column, `lower` the share of the lower pixels.
#[inline(always)]
fn cut_row(
    row: &[u32; WINDOW],
    at: &[u32; MAX_CELLS],
    shares: &[f32; MAX_CELLS],
    lower: f32,
    target: &mut [f32],
) {
    let blocks = at.as_chunks::<BLOCK>().0.iter();
    let blocks = blocks.zip(shares.as_chunks::<BLOCK>().0);
    for (target, (at, shares)) in target.chunks_mut(BLOCK).zip(blocks) {
        let quads = at.map(|at| row[at as usize % WINDOW]);
        let mut values = [0.0; BLOCK];
        for lane in 0..BLOCK {
            let [a, b, c, d] = quads[lane].to_le_bytes().map(f32::from);
            let left = a + (c - a) * lower;
            let right = b + (d - b) * lower;
            let gray = (left + (right - left) * shares[lane]) * (1.0 / 255.0);
            // Not f32::min, which takes four instructions for the sake of NaN.
            values[lane] = if gray < 1.0 { gray } else { 1.0 };
        }
        match target.as_mut_array::<BLOCK>() {
            Some(target) => *target = values,
            None => target.copy_from_slice(&values[..target.len()]),
        }
    }
}

impl Axis {
    /// `count` cells over `[start, start + extent)`, among `pixels` pixels whose own centres are at a half.
    #[inline(always)]
    pub fn lay(start: f64, extent: f64, count: u32, pixels: u32) -> Self {
        let mut axis = Self {
            first: [0; MAX_CELLS],
            share: [0.0; MAX_CELLS],
        };
        let step = extent / f64::from(count);
        let last = f64::from(pixels - 1);
        let whole = (count as usize).next_multiple_of(BLOCK);
        let cells = axis.first[..whole].iter_mut().zip(&mut axis.share);
        for (index, (first, share)) in (0_u32..).zip(cells) {
            let center = start + step * (f64::from(index) + 0.5) - 0.5;
            let clamped = center.clamp(0.0, last);
            let below = clamped.floor();
            // The low bits of 2^52 + n are n; a conversion would be done one by one.
            *first = (below + (1_u64 << 52) as f64).to_bits() as u32;
            *share = (clamped - below) as f32;
        }
        axis
    }
}

impl Region {
    /// The pixels between which the cells of `areas` lie.
    #[inline(always)]
    pub fn around(image: &GrayFrame, areas: impl Iterator<Item = Rect>) -> Self {
        let (mut left, mut top) = (f64::INFINITY, f64::INFINITY);
        let (mut right, mut bottom) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for area in areas {
            (left, right) = (left.min(area.x), right.max(area.x + area.width));
            (top, bottom) = (top.min(area.y), bottom.max(area.y + area.height));
        }
        // Cells are half a pixel or more inside their area, if it is wide; otherwise the rounding down covers them.
        let pixel = |at: f64, pixels: u32| (at - 0.5).clamp(0.0, f64::from(pixels - 1)) as u32;
        let (left, top) = (pixel(left, image.width()), pixel(top, image.height()));
        let (right, bottom) = (pixel(right, image.width()), pixel(bottom, image.height()));
        Self {
            left,
            top,
            width: (right - left) as usize + 1,
            height: (bottom - top) as usize + 1,
        }
    }

    /// Makes the quads of the region, and room for a window at the end.
    #[inline(always)]
    fn fill(&self, image: &GrayFrame, quads: &mut Vec<u32>) {
        // Room for all of the image at once, so that a region that grows allocates nothing.
        let most = image.pixels().len() + WINDOW;
        quads.reserve(most.saturating_sub(quads.len()));
        quads.resize(self.width * self.height + WINDOW, 0);
        let (width, left) = (image.width() as usize, self.left as usize);
        // The last column of the image has no right neighbour.
        let inner = self.width.min(width - 1 - left);
        let last_row = image.height() as usize - 1;
        for (y, quads) in
            (self.top as usize..).zip(quads.chunks_exact_mut(self.width).take(self.height))
        {
            let row = |y: usize| &image.pixels()[y * width + left..(y + 1) * width];
            let (upper, lower) = (row(y), row((y + 1).min(last_row)));
            let pairs = upper[..inner].iter().zip(&upper[1..]);
            let pairs = pairs.zip(lower[..inner].iter().zip(&lower[1..]));
            for (quad, ((&a, &b), (&c, &d))) in quads.iter_mut().zip(pairs) {
                *quad = u32::from_le_bytes([a, b, c, d]);
            }
            if let Some(quad) = quads.get_mut(inner) {
                let (a, c) = (upper[inner], lower[inner]);
                *quad = u32::from_le_bytes([a, a, c, c]);
            }
        }
    }
}

/// The feature vector of `area` of `image`, both in working pixels: D gray values in [0, 1], row by row.
pub fn patch(image: &GrayFrame, area: &Rect, params: &Params) -> Vec<f32> {
    let mut values = vec![0.0; params.feature_len()];
    GrayPatches::default().cut(image, std::iter::once(*area), params, &mut values);
    values
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;
    use crate::tracker::params::presets::Preset;

    fn image(width: u32, height: u32) -> GrayFrame {
        let luma = (0..width * height).map(|i| (i * 97 % 256) as u8).collect();
        GrayFrame::from_luma(width, height, luma).expect("a frame of this size")
    }

    /// Bilinear interpolation at one point, pixel by pixel.
    fn at(image: &GrayFrame, x: f64, y: f64) -> f64 {
        let pixel = |x: f64, y: f64| {
            let x = x.clamp(0.0, f64::from(image.width() - 1)) as usize;
            let y = y.clamp(0.0, f64::from(image.height() - 1)) as usize;
            f64::from(image.pixels()[y * image.width() as usize + x])
        };
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (right_share, lower_share) = (x - left, y - top);
        let row = |y| pixel(left, y) * (1.0 - right_share) + pixel(left + 1.0, y) * right_share;
        (row(top) * (1.0 - lower_share) + row(top + 1.0) * lower_share) / 255.0
    }

    /// Areas within the image, over its edges, beyond it, small and large.
    fn areas() -> [Rect; 7] {
        [
            Rect::new(5.0, 6.0, 7.0, 5.0),
            Rect::new(5.3, 6.8, 21.7, 3.9),
            Rect::new(-8.0, -3.5, 20.0, 14.0),
            Rect::new(36.0, 25.0, 30.0, 30.0),
            Rect::new(-200.0, 300.0, 10.0, 10.0),
            Rect::new(-1.5, 3.0, 320.0, 33.0),
            Rect::new(-400.0, -400.0, 1000.0, 1200.0),
        ]
    }

    #[test]
    fn every_machine_cuts_the_same_values() {
        for (columns, rows) in [(32, 32), (4, 4), (7, 5), (17, 33), (64, 64)] {
            let params = Params {
                patch_width: columns,
                patch_height: rows,
                ..Preset::Paper.params()
            };
            for (width, height) in [(320, 240), (40, 30), (240, 320), (1, 30), (40, 1), (1, 1)] {
                let image = image(width, height);
                let scratch = vec![0.5_f32; 7 * params.feature_len()];
                let areas = areas().into_iter();
                let mut cutter = GrayPatches::default();
                let mut fastest = scratch.clone();
                cutter.cut(&image, areas.clone(), &params, &mut fastest);
                let mut widest = scratch.clone();
                let cuts = cutter.cuts(&image, areas.clone(), &params, &mut widest);
                Arch::new().dispatch(cuts);
                assert_eq!(fastest, widest, "{columns} x {rows} of {width} x {height}");
                let mut plain = scratch.clone();
                let cuts = cutter.cuts(&image, areas.clone(), &params, &mut plain);
                Simd::vectorize(Scalar::new(), cuts);
                assert_eq!(fastest, plain, "{columns} x {rows} of {width} x {height}");
                #[cfg(target_arch = "x86_64")]
                if let Some(simd) = pulp::x86::V3::try_new() {
                    let mut middle = scratch;
                    Simd::vectorize(simd, cutter.cuts(&image, areas, &params, &mut middle));
                    assert_eq!(fastest, middle, "{columns} x {rows} of {width} x {height}");
                }
            }
        }
    }

    #[test]
    fn every_cell_is_interpolated_at_its_centre() {
        let params = Params {
            patch_width: 7,
            patch_height: 5,
            ..Preset::Paper.params()
        };
        for (width, height) in [(320, 40), (40, 30), (1, 30), (40, 1), (1, 1)] {
            let image = image(width, height);
            for area in areas() {
                let patch = patch(&image, &area, &params);
                for (i, &value) in patch.iter().enumerate() {
                    let x = area.x + area.width * ((i % 7) as f64 + 0.5) / 7.0;
                    let y = area.y + area.height * ((i / 7) as f64 + 0.5) / 5.0;
                    let expected = at(&image, x, y);
                    assert!((f64::from(value) - expected).abs() < 1e-5, "{area:?}, {i}");
                    assert!((0.0..=1.0).contains(&value));
                }
            }
        }
    }
}
