//! The picture that a network gets: a square of a frame, resampled, in three channels.

use bagtrack_tracker::Frame;
use bagtrack_tracker::ycbcr::chroma_size;

use crate::network::tensor::Tensor;

/// The mean of a frame's luma and chroma: what a picture shows beyond the edge of the frame.
pub(crate) fn mean(frame: &Frame) -> [f32; 3] {
    let of = |plane: &[u8]| {
        let sum: u64 = plane.iter().map(|&value| u64::from(value)).sum();
        sum as f32 / plane.len().max(1) as f32
    };
    match frame.chroma() {
        Some([cb, cr]) => [of(frame.pixels()), of(cb), of(cr)],
        None => [of(frame.pixels()), NEUTRAL, NEUTRAL],
    }
}

const NEUTRAL: f32 = 128.0;

/// A square of a frame, in the pixels of its luma.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Square {
    pub center: (f64, f64),
    pub side: f64,
}

/// The `square` of `frame`, resampled to `pixels` x `pixels`: blue, green and red from 0 to 255, as in the programs of
/// NanoTrack's authors. Beyond the frame's edge the picture has the colour `beyond`, given as luma and chroma.
pub(crate) fn crop(frame: &Frame, square: &Square, pixels: usize, beyond: [f32; 3]) -> Tensor {
    let size = (frame.width(), frame.height());
    let area = pixels * pixels;
    let mut values = vec![0.0; 3 * area];
    let (luma, chroma) = values.split_at_mut(area);
    resample(frame.pixels(), size, square, beyond[0], luma);
    if let Some(planes) = frame.chroma() {
        let half = Square {
            center: (square.center.0 / 2.0, square.center.1 / 2.0),
            side: square.side / 2.0,
        };
        let planes = planes.into_iter().zip(&beyond[1..]);
        for ((plane, &beyond), channel) in planes.zip(chroma.chunks_exact_mut(area)) {
            resample(plane, chroma_size(size), &half, beyond, channel);
        }
    } else {
        chroma.fill(NEUTRAL);
    }
    to_bgr(luma, chroma);
    Tensor {
        shape: vec![1, 3, pixels, pixels],
        values,
    }
}

/// Two neighbouring pixels on a line, and the share of the second; none for a pixel beyond the line.
#[derive(Debug, Clone, Copy)]
struct Between {
    places: [Option<usize>; 2],
    share: f32,
}

impl Between {
    /// For each of `pixels` along the square's side the neighbours of its centre on a line of `len`.
    fn along(center: f64, side: f64, pixels: usize, len: u32) -> Vec<Self> {
        let step = side / pixels as f64;
        let first = center - side / 2.0;
        let at = |pixel: usize| {
            let place = first + (pixel as f64 + 0.5) * step - 0.5;
            let left = place.floor();
            let on_line = |place: f64| {
                (0.0..f64::from(len))
                    .contains(&place)
                    .then_some(place as usize)
            };
            Self {
                places: [on_line(left), on_line(left + 1.0)],
                share: (place - left) as f32,
            }
        };
        (0..pixels).map(at).collect()
    }
}

/// Fills `channel` with the square of a plane of `size`, interpolated bilinearly.
fn resample(plane: &[u8], size: (u32, u32), square: &Square, beyond: f32, channel: &mut [f32]) {
    let pixels = channel.len().isqrt();
    let columns = Between::along(square.center.0, square.side, pixels, size.0);
    let rows = Between::along(square.center.1, square.side, pixels, size.1);
    let width = size.0 as usize;
    // A row interpolated between two rows of the plane, as far as the square reaches. Its last value stays `beyond`,
    // for pixels beyond the plane.
    let inside = columns.iter().flat_map(|column| column.places).flatten();
    let (first, last) = inside.fold((usize::MAX, 0), |(first, last), place| {
        (first.min(place), last.max(place))
    });
    let mut line = vec![beyond; 1 + (last + 1).saturating_sub(first)];
    let outside = line.len() - 1;
    let index = |place: Option<usize>| place.map_or(outside, |place| place - first);
    let taps: Vec<_> = columns
        .iter()
        .map(|column| column.places.map(index))
        .collect();
    for (row, channel) in rows.iter().zip(channel.chunks_exact_mut(pixels)) {
        let of = |place: Option<usize>| Some(&plane[place? * width..][first..=last]);
        let reaches = first <= last;
        let pair = row
            .places
            .map(|place| if reaches { of(place) } else { None });
        blend(pair, row.share, beyond, &mut line[..outside]);
        for ((value, tap), column) in channel.iter_mut().zip(&taps).zip(&columns) {
            let [left, right] = tap.map(|tap| line[tap]);
            *value = left + (right - left) * column.share;
        }
    }
}

/// Fills `line` with the row between the two of `pair`; a row beyond the plane has the value `beyond`.
fn blend(pair: [Option<&[u8]>; 2], share: f32, beyond: f32, line: &mut [f32]) {
    match pair {
        [Some(upper), Some(lower)] => {
            for ((value, &upper), &lower) in line.iter_mut().zip(upper).zip(lower) {
                let (upper, lower) = (f32::from(upper), f32::from(lower));
                *value = upper + (lower - upper) * share;
            }
        }
        [None, None] => line.fill(beyond),
        [Some(only), None] | [None, Some(only)] => {
            let share = if pair[0].is_some() {
                share
            } else {
                1.0 - share
            };
            for (value, &only) in line.iter_mut().zip(only) {
                let only = f32::from(only);
                *value = only + (beyond - only) * share;
            }
        }
    }
}

/// From luma and chroma by Rec. 601 in full range to blue, green and red.
fn to_bgr(luma: &mut [f32], chroma: &mut [f32]) {
    let (cb, cr) = chroma.split_at_mut(luma.len());
    for ((first, second), third) in luma.iter_mut().zip(cb).zip(cr) {
        let (y, cb, cr) = (*first, *second - NEUTRAL, *third - NEUTRAL);
        *first = (y + 1.772 * cb).clamp(0.0, 255.0);
        *second = (y - 0.344_136 * cb - 0.714_136 * cr).clamp(0.0, 255.0);
        *third = (y + 1.402 * cr).clamp(0.0, 255.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_is_the_frame_where_it_is_as_large_and_the_mean_beyond() {
        let pixels: Vec<u8> = (0..48).flat_map(|i| [i * 3, 200 - i, i + 40]).collect();
        let frame = Frame::from_rgb(8, 6, &pixels).unwrap();
        let gray = Frame::from_luma(8, 6, frame.pixels().to_vec()).unwrap();
        let square = Square {
            center: (4.0, 3.0),
            side: 8.0,
        };
        let picture = crop(&gray, &square, 8, [7.0, NEUTRAL, NEUTRAL]);
        for (y, row) in picture.values[..64].chunks_exact(8).enumerate() {
            for (x, &value) in row.iter().enumerate() {
                let expected = match y {
                    0 | 7 => 7.0,
                    _ => f32::from(gray.pixels()[(y - 1) * 8 + x]),
                };
                assert_eq!(value, expected, "{x}, {y}");
            }
        }
        assert_eq!(picture.values[..64], picture.values[64..128]);

        let uniform = Frame::from_rgb(8, 6, &[200, 40, 90].repeat(48)).unwrap();
        let picture = crop(&uniform, &square, 5, mean(&uniform));
        for (channel, expected) in picture.values.chunks_exact(25).zip([90.0, 40.0, 200.0]) {
            assert!(channel.iter().all(|value| (value - expected).abs() < 1.5));
        }
    }

    #[test]
    fn a_square_beside_the_frame_shows_nothing_of_it() {
        let frame = Frame::from_luma(8, 6, vec![200; 48]).unwrap();
        for center in [(-40.0, 3.0), (4.0, 90.0), (60.0, -60.0)] {
            let square = Square { center, side: 9.0 };
            let picture = crop(&frame, &square, 7, [3.0, NEUTRAL, NEUTRAL]);
            assert!(
                picture.values.iter().all(|&value| value == 3.0),
                "{center:?}"
            );
        }
    }
}
