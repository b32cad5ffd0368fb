//! Matrix products, by nalgebra's kernel.
//!
//! nalgebra keeps columns together, tensors keep rows together; so nalgebra sees a tensor as its transpose, and A · B
//! is computed as Bᵀ · Aᵀ.

use nalgebra::{DMatrixView, DMatrixViewMut};

use super::tensor::Tensor;

/// Adds the product of `first` (`rows` by `inner`) and `second` (`inner` by `columns`) to `sum`, all in row order.
pub(crate) fn add_product(
    first: &[f32],
    second: &[f32],
    (rows, inner, columns): (usize, usize, usize),
    sum: &mut [f32],
) {
    let first = DMatrixView::from_slice(first, inner, rows);
    let second = DMatrixView::from_slice(second, columns, inner);
    let mut sum = DMatrixViewMut::from_slice(sum, columns, rows);
    sum.gemm(1.0, &second, &first, 1.0);
}

/// The product of a row and a matrix, plus the bias: a fully connected layer.
pub(crate) fn gemm(
    row: &Tensor,
    matrix: &Tensor,
    transposed: bool,
    bias: Option<&Tensor>,
) -> Result<Tensor, &'static str> {
    const WRONG: &str = "its matrices do not go together";
    let (&[1, inner], &[first, second]) = (&row.shape[..], &matrix.shape[..]) else {
        return Err(WRONG);
    };
    let (columns, depth) = if transposed {
        (first, second)
    } else {
        (second, first)
    };
    let mut values = match bias {
        Some(bias) => bias.values.clone(),
        None => vec![0.0; columns],
    };
    if depth != inner || values.len() != columns {
        return Err(WRONG);
    }
    if transposed {
        for (value, weights) in values
            .iter_mut()
            .zip(matrix.values.chunks_exact(inner.max(1)))
        {
            let products = weights.iter().zip(&row.values);
            *value += products.map(|(weight, x)| weight * x).sum::<f32>();
        }
    } else {
        add_product(
            &row.values,
            &matrix.values,
            (1, inner, columns),
            &mut values,
        );
    }
    Ok(Tensor {
        shape: vec![1, columns],
        values,
    })
}

/// The product of two matrices, each in a tensor whose first side may be 1.
pub(crate) fn matmul(first: &Tensor, second: &Tensor) -> Result<Tensor, &'static str> {
    let sides = |tensor: &Tensor| match tensor.shape[..] {
        [rows, columns] | [1, rows, columns] => Some((rows, columns)),
        _ => None,
    };
    match (sides(first), sides(second)) {
        (Some((rows, inner)), Some((depth, columns)))
            if inner == depth && first.shape.len() == second.shape.len() =>
        {
            let mut values = vec![0.0; rows * columns];
            add_product(
                &first.values,
                &second.values,
                (rows, inner, columns),
                &mut values,
            );
            let mut shape = first.shape.clone();
            let last = shape.len() - 1;
            shape[last] = columns;
            Ok(Tensor { shape, values })
        }
        _ => Err("its matrices do not go together"),
    }
}
