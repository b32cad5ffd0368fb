//! A frame in larger pixels: each is the mean of a square of 2 x 2 or 4 x 4 of the frame's own.
//!
//! A feature vector has as many cells for a large target as for a small one. In larger pixels a large target costs no
//! more time than a small one, and its cells say the same. Squares that the frame's edge cuts are left out.

use std::ops::Range;

use pulp::{Arch, Simd};

use crate::image::area_average::square_means;
use crate::image::frame::Frame;
use crate::image::plane::Plane;

/// The shorter side of a cell in larger pixels is at least this long. At 4 the scale is measured too coarsely, and the
/// box does not follow a target that grows.
const MIN_CELL_SIDE: f64 = 6.0;
/// The least such side for a target that has become smaller. What the models know of it was seen at the first factor,
/// so the factor changes late.
const MIN_SHRUNK_CELL_SIDE: f64 = 4.0;
/// The largest factor.
const MAX_FACTOR: usize = 4;

/// How many working pixels along each side become one pixel: 1, 2 or 4. `first_cell` and `cell` are the shorter side of
/// a cell of the target, at first and now, and `frame_side` the shorter side of the frame, all in working pixels.
pub(crate) fn factor(first_cell: f64, cell: f64, frame_side: f64) -> usize {
    let mut factor = 1;
    while factor < MAX_FACTOR {
        let next = (2 * factor) as f64;
        // A box may be larger than the frame, and the frame's chroma must keep a pixel.
        if first_cell < MIN_CELL_SIDE * next
            || cell < MIN_SHRUNK_CELL_SIDE * next
            || frame_side < 2.0 * next
        {
            break;
        }
        factor *= 2;
    }
    factor
}

/// `frame` in pixels that are `factor` = 2 or 4 times as large; neither side of the frame is shorter than twice the
/// factor. The memory of `scratch` is used again, whatever it holds.
pub(crate) fn downsampled(frame: &Frame, factor: usize, scratch: Frame) -> Frame {
    frame.map_planes(scratch, |plane, mut pixels| {
        let columns = downsample(plane, factor, &mut pixels);
        let size = (columns as u32, (pixels.len() / columns) as u32);
        Plane::new(size, pixels, plane.pixel_side * factor as u32)
    })
}

/// Replaces `out` by the mean of each whole square of `factor` = 2 or 4 pixels a side, row by row. Returns the number
/// of squares in a row, which may be 0.
pub(crate) fn downsample(plane: &Plane, factor: usize, out: &mut Vec<u8>) -> usize {
    let (columns, rows) = squares(plane, factor);
    downsample_part(plane, factor, (0..columns, 0..rows), out);
    columns
}

/// The numbers of whole squares in a row and in a column.
pub(crate) fn squares(plane: &Plane, factor: usize) -> (usize, usize) {
    (
        plane.width as usize / factor,
        plane.height as usize / factor,
    )
}

/// As [`downsample`], for the squares of these columns and rows.
#[pulp::with_simd(downsample_part = Arch::new())]
#[inline(always)]
pub(crate) fn downsample_part_simd<S: Simd>(
    _: S,
    plane: &Plane,
    factor: usize,
    (columns, rows): (Range<usize>, Range<usize>),
    out: &mut Vec<u8>,
) {
    out.clear();
    out.resize(columns.len() * rows.len(), 0);
    let width = plane.width as usize;
    let pixels = &plane.pixels[rows.start * factor * width..];
    match factor {
        _ if out.is_empty() => {}
        2 => square_means::<2>(pixels, width, columns, out),
        4 => square_means::<4>(pixels, width, columns, out),
        _ => unreachable!("the factor is 2 or 4"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_the_rounded_means_of_whole_squares() {
        for (width, height) in [(320, 240), (43, 18), (4, 4), (3, 9), (9, 3)] {
            let texture = (0..width * height).map(|i| (i * i * 7 + i) as u8);
            for luma in [vec![255; width * height], texture.collect()] {
                let frame = Frame::from_luma(width as u32, height as u32, luma.clone());
                let frame = frame.expect("a frame of this size");
                for factor in [2, 4] {
                    let mut found = vec![1, 2, 3];
                    let columns = downsample(&frame.luma, factor, &mut found);
                    assert_eq!(columns, width / factor);
                    assert_eq!(found.len(), columns * (height / factor));
                    let count = factor * factor;
                    for (index, found) in found.into_iter().enumerate() {
                        let (left, top) = (index % columns * factor, index / columns * factor);
                        let pixel = |i: usize| luma[(top + i / factor) * width + left + i % factor];
                        let sum: usize = (0..count).map(|i| usize::from(pixel(i))).sum();
                        assert_eq!(usize::from(found), (sum + count / 2) / count);
                    }
                }
            }
        }
    }

    #[test]
    fn a_downsampled_frame_knows_its_size_and_factor() {
        let frame = Frame::from_luma(43, 18, vec![9; 43 * 18]).expect("a frame of this size");
        let found = downsampled(&frame, 4, Frame::default());
        assert_eq!((found.width(), found.height()), (10, 4));
        assert_eq!(found.luma.pixel_side, 4);
        assert_eq!(found.source_size(), (43, 18));
    }

    #[test]
    fn cells_have_six_pixels_and_four_when_they_have_shrunk() {
        let of = |cell: f64, scale: f64| factor(cell, cell * scale, 240.0);
        let sides = [3.0, 11.9, 12.1, 23.9, 24.1, 50.0];
        assert_eq!(sides.map(|cell| of(cell, 1.0)), [1, 1, 2, 2, 4, 4]);
        let scales = [2.0, 1.0, 0.67, 0.66];
        assert_eq!(scales.map(|scale| of(12.1, scale)), [2, 2, 2, 1]);
        assert_eq!(factor(45.0, 45.0, 7.0), 2);
    }
}
