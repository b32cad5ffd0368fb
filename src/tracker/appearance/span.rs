//! An affine subspace as coefficients of the templates that it is made of.
//!
//! The mean and the basis of equation 1 lie in the span of a few vectors, the templates, and a single-vector
//! candidate is compared with them by inner products only. So they are never written out under the background's
//! metric: that metric gives the Gram matrix of the templates, whose eigenvectors give the coefficients. When the
//! background changes, only small matrices change (see [`mahalanobis`](crate::tracker::appearance::mahalanobis) for
//! the background coordinates).

use pulp::{Arch, Simd};

use crate::tracker::appearance::background::Background;
use crate::tracker::appearance::subspace::{self, Gram};
use crate::tracker::features::quantized::QuantizedVector;
use crate::tracker::linalg::combinations;
use crate::tracker::linalg::gemm;
use crate::tracker::linalg::jacobi;
use crate::tracker::linalg::vector_ops;
use crate::tracker::params::table::Params;

/// A squared length under the metric below this share of the plain one is rounding.
pub(crate) const MIN_REMAINDER: f32 = 1e-6;

/// The mean, then the basis vectors, of an affine subspace.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Span {
    /// ‖μ‖².
    norm: f64,
    /// For the mean and for each basis vector, the coefficients of the templates.
    coefficients: Vec<f32>,
    /// For the mean and for each basis vector, its background coordinates.
    background_coordinates: Vec<f32>,
    /// The number of basis vectors.
    dim: usize,
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

impl Scratch {
    /// Loads the samples of `background`, under whose metric all subspaces are fitted from here on.
    pub fn load(&mut self, background: &Background) {
        load_samples(&mut self.samples, background);
    }
}

#[pulp::with_simd(load_samples = Arch::new())]
#[inline(always)]
fn load_samples_simd<S: Simd>(_: S, samples: &mut Vec<f32>, background: &Background) {
    background.samples_into(samples);
}

#[pulp::with_simd(compare_templates = Arch::new())]
#[inline(always)]
fn compare_templates_simd<S: Simd>(
    simd: S,
    templates: &[QuantizedVector],
    background: &Background,
    len: usize,
    scratch: &mut Scratch,
) {
    scratch.compare(simd, templates, background, len);
}

impl Scratch {
    /// The background coordinates of the templates, and their Gram matrix under the metric.
    #[inline(always)]
    fn compare<S: Simd>(
        &mut self,
        simd: S,
        templates: &[QuantizedVector],
        background: &Background,
        len: usize,
    ) {
        let (metric, count) = (background.metric(), templates.len());
        let samples = metric.count();
        self.vectors.resize(count * len, 0.0);
        for (template, vector) in templates.iter().zip(self.vectors.chunks_exact_mut(len)) {
            template.write(background.mean(), vector);
        }
        let (vectors, products) = (&self.vectors, &mut self.products);
        products.resize(count * samples, 0.0);
        gemm::multiply(simd, vectors, &self.samples, len, samples, products);
        self.gram.resize(count * count, 0.0);
        gemm::multiply(simd, vectors, vectors, len, count, &mut self.gram);
        self.background_coordinates.resize(count * samples, 0.0);
        let row = |i: usize| i * samples..(i + 1) * samples;
        for i in 0..count {
            let out = &mut self.background_coordinates[row(i)];
            metric.background_coordinates_of(&self.products[row(i)], out);
        }
        let coordinates = &self.background_coordinates;
        self.scales.clear();
        for i in 0..count {
            for j in 0..count {
                let plain = self.gram[i * count + j];
                let product = plain - vector_ops::dot(&coordinates[row(i)], &coordinates[row(j)]);
                let is_left = i != j || product > plain * MIN_REMAINDER;
                self.gram[i * count + j] = if is_left { product } else { 0.0 };
            }
            let square = self.gram[i * count + i];
            let scale = if square > 0.0 {
                1.0 / square.sqrt()
            } else {
                0.0
            };
            self.scales.push(scale);
        }
    }
}

impl Span {
    /// Becomes the subspace of `templates` under the metric of `background`, which `scratch` has loaded.
    pub fn fit(
        &mut self,
        templates: &[QuantizedVector],
        background: &Background,
        params: &Params,
        scratch: &mut Scratch,
    ) {
        let (count, samples) = (templates.len(), background.metric().count());
        compare_templates(templates, background, params.feature_len(), scratch);
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

    /// ‖μ‖² and the number of basis vectors.
    pub fn size(&self) -> (f64, usize) {
        (self.norm, self.dim)
    }

    /// The background coordinates of the mean and of the basis vectors.
    pub fn background_coordinates(&self) -> &[f32] {
        &self.background_coordinates
    }

    /// Writes the mean and the basis vectors, as plain vectors, to `out`, which is as long as they are. `templates` are
    /// those that this was fitted to; `scratch` is a buffer for them.
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
        for (template, vector) in templates.iter().zip(scratch.chunks_exact_mut(len)) {
            template.write(background.mean(), vector);
        }
        combinations::assign_combinations(simd, out, &self.coefficients, scratch, len);
    }
}
