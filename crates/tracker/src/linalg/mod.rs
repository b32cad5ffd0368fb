//! The few kernels of linear algebra that run in every frame.
//!
//! | file | computes |
//! |---|---|
//! | `gemm` | all inner products of two sets of vectors, f32, f64 or i16 |
//! | `fixed_point` | f32 vectors as whole numbers, and their inner products |
//! | `element` | f32, f64 or i16 in vector registers |
//! | `combinations` | linear combinations of f32 vectors |
//! | `vector_ops` | inner products, sums and lengths of single f32 vectors |
//! | `jacobi` | eigenvalues and eigenvectors of one small symmetric matrix, f64 |
//! | `scratch` | nothing: reusable, aligned buffers |
//! | `acos` | arccos² of many numbers at once, f64 |
//!
//! In and out: plain slices. A set of n vectors of length D is one slice of n D values, one vector after the other; a
//! matrix is a slice in row order. Nothing has a unit, and nothing is allocated but by buffers that grow.
//!
//! A function that takes `simd: S` is compiled for the vector instructions of its caller. The function of the same name
//! without `simd` detects the instructions of this machine, once, and calls it. Rounding depends on the width of the
//! vector registers, so results are the same bit for bit on machines of one kind only.
//!
//! What can go wrong: slices whose lengths do not fit panic. Infinities and NaN pass through as IEEE 754 says; `jacobi`
//! ends on them after a fixed number of sweeps.

pub(crate) mod acos;
pub(crate) mod combinations;
pub(crate) mod element;
pub(crate) mod fixed_point;
pub(crate) mod gemm;
pub(crate) mod jacobi;
pub(crate) mod scratch;
pub(crate) mod vector_ops;

/// Numbers from -1 to 1, for tests.
#[cfg(test)]
fn numbers<T: From<f32>>(count: usize, seed: usize) -> Vec<T> {
    let number = |i: usize| ((i * 7919 + seed * 104_729) % 1000) as f32 / 500.0 - 1.0;
    (0..count).map(|i| number(i).into()).collect()
}
