//! `cargo bench -p bagtrack-tracker --bench kernels`: the tracker's own kernels of linear algebra against nalgebra and the standard library, at the sizes of a step.

use std::fmt::Display;
use std::hint::black_box;

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, RealField, SMatrix, convert};
use pulp::{Arch, Simd};

use bagtrack_testing::cpu_time as clock;

// Each file also has what only the tracker calls, and its tests.
#[allow(dead_code, unused_imports)]
#[path = "../src/linalg/acos.rs"]
mod acos;
#[allow(dead_code, unused_imports)]
#[path = "../src/linalg/combinations.rs"]
mod combinations;
#[allow(dead_code, unused_imports)]
#[path = "../src/linalg/element.rs"]
mod element;
#[allow(dead_code, unused_imports)]
#[path = "../src/linalg/gemm.rs"]
mod gemm;
#[allow(dead_code, unused_imports)]
#[path = "../src/linalg/jacobi.rs"]
mod jacobi;

const ROUNDS: usize = 300;
/// Calls per timing, so that the cost of reading the clock is negligible.
const REPEATS: usize = 20;

/// Prints the table of docs/laboratory/PERFORMANCE.md.
fn main() {
    println!("median of {ROUNDS} rounds, in turns, processor time of one thread\n");
    println!("| kernel | own, µs | others, own = 1 |");
    println!("|---|---|---|");
    for (rows, columns) in [(110, 100), (110, 200), (64, 64), (8, 64)] {
        products::<f32>("f32", rows, columns, 640);
    }
    products::<f64>("f64", 45, 100, 1024);
    transform(17, 640);
    eigen::<3>();
    eigen::<5>();
    eigen::<11>();
    angles(1000);
}

/// Times the first action and the others against it.
fn row(kernel: impl Display, actions: Vec<(&str, clock::Action)>) {
    let (names, actions): (Vec<&str>, Vec<clock::Action>) = actions.into_iter().unzip();
    let repeated = actions.into_iter().map(|mut action| -> clock::Action {
        Box::new(move || (0..REPEATS).for_each(|_| action()))
    });
    let times = clock::medians(ROUNDS, repeated.collect());
    let ratio = |(name, time): (&&str, &f64)| format!("{name} {:.2}", time / times[0]);
    let others: Vec<String> = names.iter().zip(&times).skip(1).map(ratio).collect();
    let own = times[0] / REPEATS as f64 * 1e6;
    println!("| {kernel} | {own:.2} | {} |", others.join(", "));
}

fn numbers<T: RealField>(count: usize, seed: usize) -> Vec<T> {
    let number = |i: usize| ((i * 7919 + seed * 104_729) % 1000) as f64 / 500.0 - 1.0;
    (0..count).map(|i| convert(number(i))).collect()
}

fn products<T>(precision: &str, rows: usize, columns: usize, len: usize)
where
    T: element::Element + RealField,
{
    let (a, b) = (numbers::<T>(rows * len, 1), numbers::<T>(columns * len, 2));
    let [mut own, mut by_nalgebra] = [(); 2].map(|()| vec![T::default(); rows * columns]);
    let one: T = convert(1.0);
    row(
        format!("{rows} × {columns} inner products of length {len}, {precision}"),
        vec![
            (
                "own",
                Box::new(|| gemm::inner_products(black_box(&a), &b, len, columns, &mut own)),
            ),
            (
                "nalgebra",
                Box::new(|| {
                    let a = DMatrixView::from_slice(black_box(&a), len, rows);
                    let b = DMatrixView::from_slice_with_strides(&b, columns, len, len, 1);
                    DMatrixViewMut::from_slice(&mut by_nalgebra, columns, rows).gemm(
                        one,
                        &b,
                        &a,
                        convert(0.0),
                    );
                }),
            ),
        ],
    );
}

/// The real Fourier transform of each feature along the levels of a scale pyramid, as a matrix product.
fn transform(levels: usize, len: usize) {
    let features = numbers::<f32>(levels * len, 3);
    let rows = levels / 2 * 2 + 2;
    let coefficients = numbers::<f32>(rows * levels, 4);
    let [mut own, mut by_nalgebra] = [(); 2].map(|()| vec![0.0; rows * len]);
    row(
        format!("{rows} combinations of {levels} vectors of length {len}, f32"),
        vec![
            (
                "own",
                Box::new(|| {
                    own.fill(0.0);
                    combinations::add_combinations(
                        &mut own,
                        1.0,
                        &coefficients,
                        black_box(&features),
                        len,
                    );
                }),
            ),
            (
                "nalgebra",
                Box::new(|| {
                    let features = DMatrixView::from_slice(black_box(&features), len, levels);
                    let coefficients = DMatrixView::from_slice(&coefficients, levels, rows);
                    DMatrixViewMut::from_slice(&mut by_nalgebra, len, rows).gemm(
                        1.0,
                        &features,
                        &coefficients,
                        0.0,
                    );
                }),
            ),
        ],
    );
}

fn eigen<const M: usize>() {
    let vectors = DMatrix::from_vec(M, M + 2, numbers::<f64>(M * (M + 2), 5));
    let matrix = &vectors * vectors.transpose();
    let fixed = SMatrix::<f64, M, M>::from_iterator(matrix.iter().copied());
    row(
        format!("eigenvectors of a {M} × {M} matrix, f64"),
        vec![
            (
                "own",
                Box::new(|| {
                    black_box(jacobi::eigenpairs(*black_box(&fixed)));
                }),
            ),
            (
                "nalgebra",
                Box::new(|| {
                    black_box(black_box(&matrix).clone().symmetric_eigen());
                }),
            ),
        ],
    );
}

#[pulp::with_simd(angles_of = Arch::new())]
#[inline(always)]
fn angles_simd<S: Simd>(_: S, out: &mut [[f64; acos::LANES]], cosines: &[[f64; acos::LANES]]) {
    for (out, cosines) in out.iter_mut().zip(cosines) {
        *out = acos::squared_angles(cosines);
    }
}

fn angles(count: usize) {
    let cosines: Vec<f64> = (0..count).map(|i| i as f64 / count as f64).collect();
    let [mut own, mut by_std] = [(); 2].map(|()| vec![0.0; count]);
    row(
        format!("{count} squared angles, f64"),
        vec![
            (
                "own",
                Box::new(|| {
                    let cosines = black_box(&cosines).as_chunks().0;
                    let out = own.as_chunks_mut().0;
                    angles_of(out, cosines);
                }),
            ),
            (
                "std",
                Box::new(|| {
                    for (out, cosine) in by_std.iter_mut().zip(black_box(&cosines)) {
                        *out = cosine.sqrt().acos().powi(2);
                    }
                }),
            ),
        ],
    );
}
