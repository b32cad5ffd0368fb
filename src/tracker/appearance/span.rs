//! An affine subspace as combinations of the looks that it is made of.
//!
//! The mean and the basis of equation 1 lie in the span of a few looks, and a candidate that stands alone is compared
//! with them by inner products only. So neither is ever written out as whitened vectors: the background's metric gives the
//! looks' Gram matrix, its eigenvectors the coefficients, and with the shadows of the combinations (see
//! [`metric`](crate::tracker::appearance::mahalanobis)) a change of the background costs small matrices.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::appearance::background::Background;
use crate::tracker::appearance::subspace;
use crate::tracker::features::quantized::QuantizedVector;
use crate::tracker::linalg::combinations;
use crate::tracker::linalg::gemm;
use crate::tracker::linalg::jacobi::Spectrum;
use crate::tracker::linalg::vector_ops;
use crate::tracker::params::table::Params;

/// What is left of a squared length below this share of it is rounding.
pub(crate) const MIN_REMAINDER: f32 = 1e-6;

/// The mean, then the basis vectors, of an affine subspace.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Span {
    /// ‖μ‖².
    norm: f64,
    /// For the mean and for each basis vector, the coefficients of the looks.
    coefficients: Vec<f32>,
    /// For each of them its shadow.
    background_coordinates: Vec<f32>,
    /// The number of basis vectors.
    dim: usize,
}

/// Room for making combinations.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// The background's samples, with their mean taken off.
    samples: Vec<f32>,
    /// The looks, with that mean taken off.
    vectors: Vec<f32>,
    products: Vec<f32>,
    background_coordinates: Vec<f32>,
    gram: Vec<f32>,
    scales: Vec<f32>,
    spectrum: Spectrum,
}

/// [`Scratch::take`], to be compiled for the instructions that this machine has.
struct Take<'a> {
    scratch: &'a mut Scratch,
    background: &'a Background,
}

impl WithSimd for Take<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.background.samples_into(&mut self.scratch.samples);
    }
}

/// [`Span::fit`], to be compiled for the instructions that this machine has.
struct Fit<'a> {
    combination: &'a mut Span,
    templates: &'a [QuantizedVector],
    background: &'a Background,
    params: &'a Params,
    scratch: &'a mut Scratch,
}

impl WithSimd for Fit<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            combination,
            templates,
            background,
            params,
            scratch,
        } = self;
        combination.fit_all(simd, templates, background, params, scratch);
    }
}

impl Scratch {
    /// Takes the samples of `background`, which all combinations are made with from here on.
    pub fn load(&mut self, background: &Background) {
        Arch::new().dispatch(Take {
            scratch: self,
            background,
        });
    }
}

impl Span {
    /// Becomes the subspace of `templates` as the metric of `background`, the one that `scratch` has taken, sees them.
    pub fn fit(
        &mut self,
        templates: &[QuantizedVector],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        Arch::new().dispatch(Fit {
            combination: self,
            templates,
            background,
            params,
            scratch,
        });
    }

    #[inline(always)]
    fn fit_all<S: Simd>(
        &mut self,
        simd: S,
        templates: &[QuantizedVector],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        let (len, count) = (params.feature_len(), templates.len());
        let metric = background.metric();
        let samples = metric.count();
        scratch.vectors.resize(count * len, 0.0);
        for (look, vector) in templates.iter().zip(scratch.vectors.chunks_exact_mut(len)) {
            look.write(background.mean(), vector);
        }
        let (vectors, products) = (&scratch.vectors, &mut scratch.products);
        products.resize(count * samples, 0.0);
        gemm::multiply(simd, vectors, &scratch.samples, len, samples, products);
        scratch.background_coordinates.resize(count * samples, 0.0);
        scratch.gram.resize(count * count, 0.0);
        gemm::multiply(simd, vectors, vectors, len, count, &mut scratch.gram);
        let background_coordinates_of = |i: usize| i * samples..(i + 1) * samples;
        for i in 0..count {
            metric.background_coordinates_of(
                &scratch.products[background_coordinates_of(i)],
                &mut scratch.background_coordinates[background_coordinates_of(i)],
            );
        }
        scratch.scales.clear();
        for i in 0..count {
            for j in 0..count {
                let of_shadows = vector_ops::dot(
                    &scratch.background_coordinates[background_coordinates_of(i)],
                    &scratch.background_coordinates[background_coordinates_of(j)],
                );
                let plain = scratch.gram[i * count + j];
                let product = plain - of_shadows;
                let is_left = i != j || product > plain * MIN_REMAINDER;
                scratch.gram[i * count + j] = if is_left { product } else { 0.0 };
            }
            let square = scratch.gram[i * count + i];
            scratch.scales.push(if square > 0.0 {
                1.0 / square.sqrt()
            } else {
                0.0
            });
        }
        self.combine(count, params.basis_dim as usize, scratch);
        self.background_coordinates.clear();
        for row in self.coefficients.chunks_exact(count) {
            let first = self.background_coordinates.len();
            self.background_coordinates.resize(first + samples, 0.0);
            for (i, coefficient) in row.iter().enumerate() {
                let target = &mut self.background_coordinates[first..];
                vector_ops::add(
                    target,
                    *coefficient,
                    &scratch.background_coordinates[background_coordinates_of(i)],
                );
            }
        }
    }

    /// The coefficients, from the Gram matrix of `count` looks and the factors that bring them to their length.
    fn combine(&mut self, count: usize, basis_dim: usize, scratch: &mut Scratch) {
        let scale = |i: usize| f64::from(scratch.scales[i]);
        let gram =
            |i: usize, j: usize| f64::from(scratch.gram[i * count + j]) * scale(i) * scale(j);
        let share = 1.0 / count as f64;
        let sum = (0..count * count).map(|at| gram(at / count, at % count));
        self.norm = (sum.sum::<f64>() * share * share).max(0.0);
        self.coefficients.clear();
        self.coefficients
            .extend((0..count).map(|i| (share * scale(i)) as f32));
        scratch.spectrum.solve(count, gram);
        self.dim = subspace::dominant(scratch.spectrum.values(), basis_dim);
        for (place, value) in scratch.spectrum.values().take(self.dim).enumerate() {
            let weight = |i: usize| scratch.spectrum.weight(place, i) / value.sqrt() * scale(i);
            self.coefficients
                .extend((0..count).map(|i| weight(i) as f32));
        }
    }

    /// ‖μ‖² and the number of basis vectors.
    pub fn size(&self) -> (f64, usize) {
        (self.norm, self.dim)
    }

    /// The shadows of the mean and of the basis vectors.
    pub fn background_coordinates(&self) -> &[f32] {
        &self.background_coordinates
    }

    /// Writes the mean and the basis vectors, before the metric, to `out`, which is as long as they are. `templates` are those
    /// that this was made of; `scratch` is room for them.
    #[inline(always)]
    pub fn write_to<S: Simd>(
        &self,
        simd: S,
        templates: &[QuantizedVector],
        background: &Background,
        scratch: &mut Vec<f32>,
        out: &mut [f32],
    ) {
        let len = out.len() / (1 + self.dim);
        scratch.resize(templates.len() * len, 0.0);
        for (look, vector) in templates.iter().zip(scratch.chunks_exact_mut(len)) {
            look.write(background.mean(), vector);
        }
        combinations::assign_combinations(simd, out, &self.coefficients, scratch, len);
    }
}
