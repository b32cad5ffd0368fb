//! Convolutions of one image: over all channels as a matrix product, and channel by channel in vector registers.

use std::ops::Range;

use pulp::{Arch, Simd};

use super::memory::Memory;
use super::operation::Convolution;
use super::product::add_product;
use super::tensor::Tensor;

/// Neighbouring results of one channel that are summed in registers.
const TILE: usize = 16;

/// `image` convolved with `weights` (outputs, inputs of a group, height, width), plus a `bias` for each output.
pub(crate) fn convolve(
    image: &Tensor,
    weights: &Tensor,
    bias: Option<&Tensor>,
    by: &Convolution,
    memory: &mut Memory,
) -> Result<Tensor, &'static str> {
    let (channels, height, width) = image.image().ok_or("its input is no image")?;
    let &[outputs, of_group, kernel_height, kernel_width] = &weights.shape[..] else {
        return Err("its weights are not those of images");
    };
    let [top, left, bottom, right] = by.pads;
    let shape = Shape {
        channels,
        size: (height, width),
        kernel: (kernel_height, kernel_width),
        pads: (top, left),
        padded: (height + top + bottom, width + left + right),
        stride: by.stride,
    };
    let is_bias_whole = bias.is_none_or(|bias| bias.values.len() == outputs);
    if channels != of_group * by.groups || !is_bias_whole || !shape.is_possible() {
        return Err("its weights do not fit its input");
    }
    let (rows, columns) = shape.result();
    let mut values = memory.filled(outputs * rows * columns, 0.0);
    if let Some(bias) = bias {
        for (plane, &bias) in values.chunks_exact_mut(rows * columns).zip(&bias.values) {
            plane.fill(bias);
        }
    }
    if by.groups == 1 {
        over_all(image, &weights.values, &shape, outputs, &mut values, memory);
    } else if of_group == 1 && outputs == channels {
        by_channel(image, &weights.values, &shape, &mut values, memory);
    } else {
        return Err("it has groups of more than one channel");
    }
    Ok(Tensor {
        shape: vec![1, outputs, rows, columns],
        values,
    })
}

/// The sizes of a convolution; height comes before width.
#[derive(Debug, Clone, Copy)]
struct Shape {
    channels: usize,
    size: (usize, usize),
    kernel: (usize, usize),
    /// Zeros above and left.
    pads: (usize, usize),
    /// The image with all zeros around it.
    padded: (usize, usize),
    stride: usize,
}

impl Shape {
    fn is_possible(&self) -> bool {
        let (kernel, padded) = (self.kernel, self.padded);
        kernel.0 > 0 && kernel.1 > 0 && kernel.0 <= padded.0 && kernel.1 <= padded.1
    }

    /// Rows and columns of the result.
    fn result(&self) -> (usize, usize) {
        (
            (self.padded.0 - self.kernel.0) / self.stride + 1,
            (self.padded.1 - self.kernel.1) / self.stride + 1,
        )
    }

    /// The results for which the kernel's pixel `at` lies in the image, of `results` along a side of `size` pixels with
    /// `pad` zeros before it.
    fn inside(&self, at: usize, pad: usize, size: usize, results: usize) -> Range<usize> {
        let first = pad.saturating_sub(at).div_ceil(self.stride);
        let end = (size + pad).saturating_sub(at).div_ceil(self.stride);
        first.min(results)..end.clamp(first.min(results), results)
    }
}

/// All channels into each output: for each channel and each pixel of the kernel a row of the image's pixels that it
/// meets, and one matrix product with these rows (im2col).
fn over_all(
    image: &Tensor,
    weights: &[f32],
    shape: &Shape,
    outputs: usize,
    values: &mut [f32],
    memory: &mut Memory,
) {
    let (rows, columns) = shape.result();
    let is_point = shape.kernel == (1, 1) && shape.stride == 1 && shape.padded == shape.size;
    if is_point {
        let sides = (outputs, shape.channels, rows * columns);
        return add_product(weights, &image.values, sides, values);
    }
    let (kernel_height, kernel_width) = shape.kernel;
    let inner = shape.channels * kernel_height * kernel_width;
    let mut met = memory.filled(inner * rows * columns, 0.0);
    let mut of_pixel = met.chunks_exact_mut(rows * columns);
    for channel in image.values.chunks_exact(shape.size.0 * shape.size.1) {
        for ky in 0..kernel_height {
            for kx in 0..kernel_width {
                let meets = of_pixel
                    .next()
                    .expect("there is a row for each pixel and channel");
                gather(channel, shape, (ky, kx), meets);
            }
        }
    }
    add_product(weights, &met, (outputs, inner, rows * columns), values);
    memory.give_back(met);
}

/// Fills `meets`, which is 0, with the pixels of the image that the kernel's pixel `(ky, kx)` meets, one for each
/// result.
fn gather(channel: &[f32], shape: &Shape, (ky, kx): (usize, usize), meets: &mut [f32]) {
    let (rows, columns) = shape.result();
    let within = shape.inside(kx, shape.pads.1, shape.size.1, columns);
    for row in shape.inside(ky, shape.pads.0, shape.size.0, rows) {
        let y = row * shape.stride + ky - shape.pads.0;
        let line = &channel[y * shape.size.1..][..shape.size.1];
        if within.is_empty() {
            continue;
        }
        let first = within.start * shape.stride + kx - shape.pads.1;
        let met = line[first..].iter().step_by(shape.stride);
        for (meets, &value) in meets[row * columns..][within.clone()].iter_mut().zip(met) {
            *meets = value;
        }
    }
}

/// Each channel into its own output.
fn by_channel(
    image: &Tensor,
    weights: &[f32],
    shape: &Shape,
    values: &mut [f32],
    memory: &mut Memory,
) {
    // Columns that are a stride apart lie together, so that neighbours in the result are neighbours in memory. Behind
    // the last row there is room for a tile that reaches beyond it.
    let line = shape.padded.1.div_ceil(shape.stride).next_multiple_of(8);
    let phase = shape.padded.0 * line + TILE + shape.kernel.1;
    let mut padded = memory.filled(phase * shape.stride, 0.0);
    let planes = image.values.chunks_exact(shape.size.0 * shape.size.1);
    let (rows, columns) = shape.result();
    let kernels = weights.chunks_exact(shape.kernel.0 * shape.kernel.1);
    let results = values.chunks_exact_mut(rows * columns);
    for ((plane, kernel), result) in planes.zip(kernels).zip(results) {
        for (y, pixels) in plane.chunks_exact(shape.size.1).enumerate() {
            let at = (y + shape.pads.0) * line;
            spread(pixels, shape, &mut padded, phase, at);
        }
        convolve_channel(&padded, phase, line, shape, kernel, result);
    }
    memory.give_back(padded);
}

/// Writes a row of the image into the row of each phase, which begins at `at`.
fn spread(pixels: &[f32], shape: &Shape, padded: &mut [f32], phase: usize, at: usize) {
    let left = shape.pads.1;
    if shape.stride == 1 {
        padded[at + left..][..pixels.len()].copy_from_slice(pixels);
        return;
    }
    for of_phase in 0..shape.stride {
        // The first pixel whose column is of this phase.
        let first = (of_phase + shape.stride - left % shape.stride) % shape.stride;
        let column = of_phase * phase + at + (first + left) / shape.stride;
        let pixels = pixels.iter().skip(first).step_by(shape.stride);
        for (padded, &pixel) in padded[column..].iter_mut().zip(pixels) {
            *padded = pixel;
        }
    }
}

#[pulp::with_simd(convolve_channel = Arch::new())]
#[inline(always)]
fn convolve_channel_simd<S: Simd>(
    _: S,
    padded: &[f32],
    phase: usize,
    line: usize,
    shape: &Shape,
    kernel: &[f32],
    result: &mut [f32],
) {
    let (_, columns) = shape.result();
    for (row, results) in result.chunks_exact_mut(columns).enumerate() {
        for (tile, results) in results.chunks_mut(TILE).enumerate() {
            let mut sums = [0.0; TILE];
            for (ky, weights) in kernel.chunks_exact(shape.kernel.1).enumerate() {
                let at = (row * shape.stride + ky) * line + tile * TILE;
                for (kx, &weight) in weights.iter().enumerate() {
                    let at = kx % shape.stride * phase + at + kx / shape.stride;
                    let met = &padded[at..][..TILE];
                    for (sum, &value) in sums.iter_mut().zip(met) {
                        *sum += weight * value;
                    }
                }
            }
            for (result, sum) in results.iter_mut().zip(sums) {
                *result += sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, as a sum over all pixels of the kernel.
    fn by_definition(
        image: &Tensor,
        weights: &Tensor,
        bias: &Tensor,
        by: &Convolution,
    ) -> Vec<f32> {
        let (_, height, width) = image.image().unwrap();
        let &[outputs, inputs, kernel_height, kernel_width] = &weights.shape[..] else {
            panic!("four sides");
        };
        let [top, left, bottom, right] = by.pads;
        let rows = (height + top + bottom - kernel_height) / by.stride + 1;
        let columns = (width + left + right - kernel_width) / by.stride + 1;
        let mut values = Vec::new();
        for output in 0..outputs {
            let first = output / (outputs / by.groups) * inputs;
            for index in 0..rows * columns {
                let mut sum = bias.values[output];
                for tap in 0..inputs * kernel_height * kernel_width {
                    let (kx, rest) = (tap % kernel_width, tap / kernel_width);
                    let (ky, input) = (rest % kernel_height, rest / kernel_height);
                    let y = (index / columns * by.stride + ky).checked_sub(top);
                    let x = (index % columns * by.stride + kx).checked_sub(left);
                    if let (Some(y), Some(x)) = (y, x)
                        && y < height
                        && x < width
                    {
                        let weight =
                            weights.values[output * inputs * kernel_height * kernel_width + tap];
                        sum += weight * image.values[((first + input) * height + y) * width + x];
                    }
                }
                values.push(sum);
            }
        }
        values
    }

    fn tensor(shape: [usize; 4], factor: usize) -> Tensor {
        let value = |index: usize| ((index * factor) % 23) as f32 / 7.0 - 1.5;
        Tensor {
            shape: shape.to_vec(),
            values: (0..shape.iter().product()).map(value).collect(),
        }
    }

    #[test]
    fn convolutions_are_those_of_the_definition() {
        let mut memory = Memory::default();
        // Channels, rows, columns; outputs, inputs of a group, rows and columns of the kernel; groups, stride, zeros.
        for (image, kernel, groups, stride, pads) in [
            ([3, 31, 33], [4, 3, 3, 3], 1, 2, [1, 1, 1, 1]),
            ([6, 9, 7], [5, 6, 1, 1], 1, 1, [0, 0, 0, 0]),
            ([6, 9, 7], [5, 6, 1, 1], 1, 2, [0, 0, 0, 0]),
            ([2, 5, 4], [3, 2, 2, 3], 1, 1, [0, 2, 1, 0]),
            ([5, 16, 16], [5, 1, 5, 5], 5, 1, [2, 2, 2, 2]),
            ([5, 33, 47], [5, 1, 5, 5], 5, 2, [2, 2, 2, 2]),
            ([3, 64, 64], [3, 1, 3, 3], 3, 2, [1, 1, 1, 1]),
            ([4, 15, 15], [4, 1, 4, 4], 4, 1, [1, 1, 1, 1]),
            ([4, 3, 2], [4, 1, 2, 1], 4, 1, [0, 3, 1, 0]),
        ] {
            let by = Convolution {
                groups,
                stride,
                pads,
            };
            let image = tensor([1, image[0], image[1], image[2]], 5);
            let (weights, bias) = (tensor(kernel, 3), tensor([1, 1, 1, kernel[0]], 11));
            let expected = by_definition(&image, &weights, &bias, &by);
            // Twice: the second run has the memory of the first.
            for _ in 0..2 {
                let computed = convolve(&image, &weights, Some(&bias), &by, &mut memory).unwrap();
                assert_eq!(computed.values.len(), expected.len(), "{by:?}");
                for (computed, expected) in computed.values.iter().zip(&expected) {
                    assert!(
                        (computed - expected).abs() < 1e-3,
                        "{by:?}: {computed} {expected}"
                    );
                }
                memory.give_back(vec![f32::NAN; 100_000]);
            }
        }
    }

    #[test]
    fn shapes_that_do_not_fit_are_refused() {
        let mut memory = Memory::default();
        let image = tensor([1, 4, 3, 3], 1);
        for (kernel, groups, pads) in [
            ([4, 3, 1, 1], 1, [0; 4]),
            ([4, 4, 4, 4], 1, [0; 4]),
            ([4, 2, 1, 1], 2, [0; 4]),
            ([4, 4, 0, 1], 1, [0; 4]),
        ] {
            let by = Convolution {
                groups,
                stride: 1,
                pads,
            };
            convolve(&image, &tensor(kernel, 3), None, &by, &mut memory).unwrap_err();
        }
    }
}
