//! Operations that change, average or move single numbers.

use super::tensor::Tensor;

/// How the numbers of a smaller tensor are repeated beside those of a larger one: each of them stands beside `run`
/// numbers in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Broadcast {
    run: usize,
}

impl Broadcast {
    /// How `smaller` goes beside `larger`: of the same shape, one number, or one for each channel.
    pub fn of(larger: &Tensor, smaller: &Tensor) -> Result<Self, &'static str> {
        if smaller.shape == larger.shape {
            return Ok(Self { run: 1 });
        }
        if smaller.values.len() == 1 {
            return Ok(Self {
                run: larger.values.len(),
            });
        }
        match (larger.image(), smaller.image()) {
            (Some((channels, height, width)), Some((of, 1, 1))) if channels == of => Ok(Self {
                run: height * width,
            }),
            _ => Err("its inputs have shapes that do not go together"),
        }
    }
}

pub(crate) fn map(values: &mut [f32], function: impl Fn(f32) -> f32) {
    for value in values {
        *value = function(*value);
    }
}

/// Changes each number by that which stands beside it in `other`.
pub(crate) fn combine(
    values: &mut [f32],
    other: &[f32],
    broadcast: Broadcast,
    combine: impl Fn(&mut f32, f32),
) {
    if broadcast.run == 1 {
        for (value, &other) in values.iter_mut().zip(other) {
            combine(value, other);
        }
        return;
    }
    for (run, &other) in values.chunks_exact_mut(broadcast.run).zip(other) {
        for value in run {
            combine(value, other);
        }
    }
}

pub(crate) fn average(of: &Tensor) -> Result<Tensor, &'static str> {
    let (channels, height, width) = of.image().ok_or("its input is no image")?;
    let planes = of.values.chunks_exact((height * width).max(1));
    let mean = |plane: &[f32]| {
        // Eight sums at once: in a single sum each addition would wait for the one before.
        let (parts, rest) = plane.as_chunks::<8>();
        let mut sums = [0.0; 8];
        for part in parts {
            for (sum, value) in sums.iter_mut().zip(part) {
                *sum += value;
            }
        }
        let sum: f32 = sums.iter().chain(rest).sum();
        sum / plane.len() as f32
    };
    Ok(Tensor {
        shape: vec![1, channels, 1, 1],
        values: planes.map(mean).collect(),
    })
}

/// The same numbers in another shape; a side of 0 stays as it was, and one of -1 is what the others leave.
pub(crate) fn reshaped(mut of: Tensor, shape: &[i64]) -> Result<Tensor, &'static str> {
    let mut sides = Vec::new();
    for (index, &side) in shape.iter().enumerate() {
        sides.push(match side {
            -1 => 0,
            0 => *of
                .shape
                .get(index)
                .ok_or("it keeps a side that is not there")?,
            side => usize::try_from(side).map_err(|_| "a side is negative")?,
        });
    }
    if let Some(free) = shape.iter().position(|&side| side == -1) {
        let others = sides.iter().enumerate().filter(|(index, _)| *index != free);
        let others: usize = others.map(|(_, side)| side).product();
        sides[free] = of.values.len() / others.max(1);
    }
    if sides.iter().product::<usize>() != of.values.len() {
        return Err("its shape has another number of numbers");
    }
    of.shape = sides;
    Ok(of)
}

/// The tensor with its sides in another `order`; without an order, reversed.
pub(crate) fn transposed(of: &Tensor, order: &[usize]) -> Result<Tensor, &'static str> {
    let order: Vec<usize> = match order {
        [] => (0..of.shape.len()).rev().collect(),
        order => order.to_vec(),
    };
    let mut sorted = order.clone();
    sorted.sort_unstable();
    if !sorted.into_iter().eq(0..of.shape.len()) {
        return Err("its order is not one of the sides");
    }
    let mut strides = vec![1; of.shape.len()];
    for side in (1..of.shape.len()).rev() {
        strides[side - 1] = strides[side] * of.shape[side];
    }
    let shape: Vec<usize> = order.iter().map(|&side| of.shape[side]).collect();
    let strides: Vec<usize> = order.iter().map(|&side| strides[side]).collect();
    let mut values = Vec::with_capacity(of.values.len());
    let mut at = vec![0; shape.len()];
    for _ in 0..of.values.len() {
        let index: usize = at
            .iter()
            .zip(&strides)
            .map(|(at, stride)| at * stride)
            .sum();
        values.push(of.values[index]);
        for side in (0..shape.len()).rev() {
            at[side] += 1;
            if at[side] < shape[side] {
                break;
            }
            at[side] = 0;
        }
    }
    Ok(Tensor { shape, values })
}

/// The part between `starts` and `ends` along the axes, from the first on where none are given. A negative index counts
/// from the end.
pub(crate) fn sliced(
    of: &Tensor,
    starts: &[i64],
    ends: &[i64],
    axes: Option<&[i64]>,
) -> Result<Tensor, &'static str> {
    let mut part = of.clone();
    for (index, (&start, &end)) in starts.iter().zip(ends).enumerate() {
        let axis = match axes {
            Some(axes) => axes.get(index).copied().unwrap_or(-1),
            None => index as i64,
        };
        let axis = usize::try_from(axis)
            .ok()
            .filter(|&axis| axis < part.shape.len());
        let axis = axis.ok_or("its axis is not one of the tensor's")?;
        let len = part.shape[axis] as i64;
        let place = |index: i64| {
            let index = if index < 0 {
                index.saturating_add(len)
            } else {
                index
            };
            index.clamp(0, len) as usize
        };
        let (start, end) = (place(start), place(end));
        if start >= end {
            return Err("it leaves nothing");
        }
        let inner: usize = part.shape[axis + 1..].iter().product();
        let blocks = part.values.chunks_exact(part.shape[axis] * inner);
        let kept = blocks.flat_map(|block| &block[start * inner..end * inner]);
        part.values = kept.copied().collect();
        part.shape[axis] = end - start;
    }
    Ok(part)
}

/// The parts one after the other along `axis`.
pub(crate) fn concatenated(parts: &[&Tensor], axis: usize) -> Result<Tensor, &'static str> {
    let first = parts.first().ok_or("it has no input")?;
    let rest_of = |shape: &[usize]| {
        let mut shape = shape.to_vec();
        if axis < shape.len() {
            shape[axis] = 0;
        }
        shape
    };
    let fits = |part: &&Tensor| rest_of(&part.shape) == rest_of(&first.shape);
    if axis >= first.shape.len() || !parts.iter().all(fits) {
        return Err("its inputs have shapes that do not go together");
    }
    let outer: usize = first.shape[..axis].iter().product();
    let mut shape = first.shape.clone();
    shape[axis] = parts.iter().map(|part| part.shape[axis]).sum();
    let mut values = Vec::with_capacity(shape.iter().product());
    for block in 0..outer {
        for part in parts {
            let len = part.values.len() / outer.max(1);
            values.extend_from_slice(&part.values[block * len..][..len]);
        }
    }
    Ok(Tensor { shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(shape: &[usize]) -> Tensor {
        Tensor {
            shape: shape.to_vec(),
            values: (0..shape.iter().product::<usize>())
                .map(|value| value as f32)
                .collect(),
        }
    }

    #[test]
    fn tensors_are_moved_as_onnx_says() {
        let tensor = counted(&[1, 2, 3]);
        let turned = transposed(&tensor, &[0, 2, 1]).unwrap();
        assert_eq!(turned.shape, [1, 3, 2]);
        assert_eq!(turned.values, [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
        let part = sliced(&tensor, &[1, -2], &[2, 99], Some(&[1, 2])).unwrap();
        assert_eq!((part.shape, part.values), (vec![1, 1, 2], vec![4.0, 5.0]));
        let both = concatenated(&[&tensor, &counted(&[1, 1, 3])], 1).unwrap();
        assert_eq!(both.shape, [1, 3, 3]);
        assert_eq!(both.values[3..], [3.0, 4.0, 5.0, 0.0, 1.0, 2.0]);
        assert_eq!(reshaped(tensor, &[0, -1]).unwrap().shape, [1, 6]);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let tensor = counted(&[1, 2, 3]);
        transposed(&tensor, &[0, 1, 1]).unwrap_err();
        sliced(&tensor, &[2], &[1], None).unwrap_err();
        sliced(&tensor, &[0], &[1], Some(&[3])).unwrap_err();
        concatenated(&[&tensor, &counted(&[1, 2, 4])], 1).unwrap_err();
        reshaped(tensor.clone(), &[4, -1]).unwrap_err();
        Broadcast::of(&tensor, &counted(&[1, 2])).unwrap_err();
    }

    #[test]
    fn a_channel_is_averaged_and_scaled_as_a_whole() {
        let mut image = counted(&[1, 2, 3, 5]);
        let mean = average(&image).unwrap();
        assert_eq!(mean.values, [7.0, 22.0]);
        let broadcast = Broadcast::of(&image, &mean).unwrap();
        combine(&mut image.values, &mean.values, broadcast, |value, mean| {
            *value -= mean
        });
        assert_eq!((image.values[0], image.values[15]), (-7.0, -7.0));
    }
}
