//! An affine subspace as coefficients of the templates that it is made of.
//!
//! The mean and the basis of equation 1 lie in the span of a few vectors, the templates, and a single-vector candidate
//! is compared with them by inner products only. So the mean and the basis are never written out under the background's
//! metric: that metric gives the Gram matrix of the templates, whose eigenvectors give the coefficients. When the
//! background changes, only small matrices change (see [`mahalanobis`](crate::appearance::mahalanobis) for the
//! background coordinates).

use pulp::{Arch, Simd};
use serde::{Deserialize, Serialize};

use crate::appearance::background::Background;
use crate::features::quantized::QuantizedVector;
use crate::grassmann::subspace::{self, AffineSubspace, Gram};
use crate::linalg::{combinations, gemm, jacobi, vector_ops};
use crate::params::table::Params;

/// The mean, then the basis vectors, of an affine subspace. A snapshot carries the templates: the rest follows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Span {
    /// The vectors that the subspace was made of.
    pub templates: Vec<QuantizedVector>,
    /// ‖μ‖².
    #[serde(skip)]
    pub norm: f64,
    /// For the mean and for each basis vector, the coefficients of the templates.
    #[serde(skip)]
    coefficients: Vec<f32>,
    /// For the mean and for each basis vector, its background coordinates.
    #[serde(skip)]
    pub background_coordinates: Vec<f32>,
    /// The number of basis vectors.
    #[serde(skip)]
    pub dim: usize,
}

/// Buffers for fitting subspaces.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// The background's samples, with their mean subtracted.
    samples: Vec<f32>,
    /// The templates, with that mean subtracted.
    vectors: Vec<f32>,
    products: Vec<f32>,
    background_coordinates: Vec<f32>,
    gram: Vec<f32>,
    /// The factors that bring the templates to unit length.
    scales: Vec<f32>,
}

/// Loads the samples of `background`, under whose metric all subspaces are fitted from here on.
#[pulp::with_simd(load = Arch::new())]
#[inline(always)]
pub(crate) fn load_simd<S: Simd>(_: S, scratch: &mut Scratch, background: &Background) {
    background.samples_into(&mut scratch.samples);
}

/// The background coordinates of the templates, and their Gram matrix under the metric.
#[pulp::with_simd(compare_templates = Arch::new())]
#[inline(always)]
fn compare_templates_simd<S: Simd>(
    simd: S,
    templates: &[QuantizedVector],
    background: &Background,
    len: usize,
    scratch: &mut Scratch,
) {
    let Scratch {
        samples,
        vectors,
        products,
        background_coordinates: coordinates,
        gram,
        scales,
    } = scratch;
    let (count, width) = (templates.len(), background.metric.count);
    vectors.resize(count * len, 0.0);
    for (template, vector) in templates.iter().zip(vectors.chunks_exact_mut(len)) {
        template.write(&background.mean, vector);
    }
    products.resize(count * width, 0.0);
    gemm::multiply(simd, vectors, samples, len, width, products);
    gram.resize(count * count, 0.0);
    gemm::multiply(simd, vectors, vectors, len, count, gram);
    coordinates.resize(count * width, 0.0);
    let row = |i: usize| i * width..(i + 1) * width;
    for i in 0..count {
        let out = &mut coordinates[row(i)];
        background
            .metric
            .background_coordinates_of(&products[row(i)], out);
    }
    scales.clear();
    for i in 0..count {
        for j in 0..count {
            let plain = gram[i * count + j];
            let product = plain - vector_ops::dot(&coordinates[row(i)], &coordinates[row(j)]);
            let is_left = i != j || product > plain * vector_ops::MIN_REMAINDER;
            gram[i * count + j] = if is_left { product } else { 0.0 };
        }
        let square = gram[i * count + i];
        scales.push(if square > 0.0 {
            1.0 / square.sqrt()
        } else {
            0.0
        });
    }
}

impl Span {
    /// Becomes the subspace of `vectors`, of length D one after the other, under the metric of `background`, which
    /// `scratch` has loaded.
    pub fn fit(
        &mut self,
        vectors: &[f32],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        let vectors = vectors.chunks_exact(params.feature_len());
        self.templates
            .resize_with(vectors.len(), QuantizedVector::default);
        for (template, vector) in self.templates.iter_mut().zip(vectors) {
            template.set(vector);
        }
        self.refit(background, params, scratch);
    }

    /// Becomes the subspace of the same templates under the metric of another `background`, which `scratch` has loaded.
    pub fn refit(&mut self, background: &Background, params: &Params, scratch: &mut Scratch) {
        let (count, samples) = (self.templates.len(), background.metric.count);
        compare_templates(&self.templates, background, params.feature_len(), scratch);
        self.combine(count, params.basis_dim as usize, scratch);
        self.background_coordinates.clear();
        for coefficients in self.coefficients.chunks_exact(count) {
            let first = self.background_coordinates.len();
            self.background_coordinates.resize(first + samples, 0.0);
            let out = &mut self.background_coordinates[first..];
            for (i, &coefficient) in coefficients.iter().enumerate() {
                let of_template = &scratch.background_coordinates[i * samples..][..samples];
                vector_ops::add(out, coefficient, of_template);
            }
        }
    }

    /// The coefficients, from the Gram matrix of `count` templates and the factors that bring them to unit length.
    fn combine(&mut self, count: usize, basis_dim: usize, scratch: &Scratch) {
        let scale = |i: usize| f64::from(scratch.scales[i]);
        let mut gram = Gram::zeros();
        for (i, row) in scratch.gram.chunks_exact(count).enumerate() {
            for (j, &product) in row.iter().enumerate() {
                gram[(i, j)] = f64::from(product) * scale(i) * scale(j);
            }
        }
        let share = 1.0 / count as f64;
        self.norm = (gram.sum() * share * share).max(0.0);
        self.coefficients.clear();
        self.coefficients
            .extend((0..count).map(|i| (share * scale(i)) as f32));
        let (values, vectors) = jacobi::eigenpairs(gram);
        self.dim = subspace::dominant(values.iter().copied(), basis_dim);
        for (place, value) in values.iter().take(self.dim).enumerate() {
            let weight = |i: usize| vectors[(i, place)] / value.sqrt() * scale(i);
            self.coefficients
                .extend((0..count).map(|i| weight(i) as f32));
        }
    }

    /// The subspace of the templates under the plain metric, for people to look at.
    pub fn subspace(&self, params: &Params) -> AffineSubspace {
        let mut subspace = AffineSubspace::default();
        let len = params.feature_len();
        let mut vectors = vec![0.0; self.templates.len() * len];
        for (template, vector) in self.templates.iter().zip(vectors.chunks_exact_mut(len)) {
            template.write(&[], vector);
        }
        subspace::fit(&mut subspace, &vectors, len, params.basis_dim as usize);
        subspace
    }

    /// Writes the mean and the basis vectors, as plain vectors, to `out`, which is as long as they are. `scratch` is a
    /// buffer for the templates.
    #[inline(always)]
    pub fn write_to<S: Simd>(
        &self,
        simd: S,
        background: &Background,
        scratch: &mut Vec<f32>,
        out: &mut [f32],
    ) {
        let len = out.len() / (1 + self.dim);
        scratch.resize(self.templates.len() * len, 0.0);
        for (template, vector) in self.templates.iter().zip(scratch.chunks_exact_mut(len)) {
            template.write(&background.mean, vector);
        }
        combinations::assign_combinations(simd, out, &self.coefficients, scratch, len);
    }
}
