//! An affine subspace as combinations of the looks that it is made of.
//!
//! The mean and the basis of equation 1 lie in the span of a few looks, and a candidate that stands alone is compared
//! with them by inner products only. So neither is ever written out as whitened vectors: the background's metric gives the
//! looks' Gram matrix, its eigenvectors the coefficients, and with the shadows of the combinations (see
//! [`metric`](crate::tracker::appearance::mahalanobis)) a change of the background costs small matrices.

use pulp::{Arch, Simd, WithSimd};

use crate::tracker::appearance::background::Background;
use crate::tracker::linalg::jacobi::Spectrum;
use crate::tracker::features::quantized::Look;
use crate::tracker::params::table::Params;
use crate::tracker::linalg::gemm;
use crate::tracker::linalg::vector_ops;
use crate::tracker::appearance::subspace;

/// What is left of a squared length below this share of it is rounding.
pub(crate) const LEAST_LEFT: f32 = 1e-6;

/// The mean, then the basis vectors, of an affine subspace.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Combination {
    /// ‖μ‖².
    norm: f64,
    /// For the mean and for each basis vector, the coefficients of the looks.
    coefficients: Vec<f32>,
    /// For each of them its shadow.
    shadows: Vec<f32>,
    /// The number of basis vectors.
    dim: usize,
}

/// Room for making combinations.
#[derive(Debug, Default)]
pub(crate) struct Room {
    /// The background's samples, with their mean taken off.
    samples: Vec<f32>,
    /// The looks, with that mean taken off.
    vectors: Vec<f32>,
    products: Vec<f32>,
    shadows: Vec<f32>,
    gram: Vec<f32>,
    scales: Vec<f32>,
    spectrum: Spectrum,
}

/// [`Room::take`], to be compiled for the instructions that this machine has.
struct Take<'a> {
    room: &'a mut Room,
    background: &'a Background,
}

impl WithSimd for Take<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.background.samples_into(&mut self.room.samples);
    }
}

/// [`Combination::become_of`], to be compiled for the instructions that this machine has.
struct BecomeOf<'a> {
    combination: &'a mut Combination,
    looks: &'a [Look],
    background: &'a Background,
    params: &'a Params,
    room: &'a mut Room,
}

impl WithSimd for BecomeOf<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            combination,
            looks,
            background,
            params,
            room,
        } = self;
        combination.become_all(simd, looks, background, params, room);
    }
}

impl Room {
    /// Takes the samples of `background`, which all combinations are made with from here on.
    pub fn take(&mut self, background: &Background) {
        Arch::new().dispatch(Take {
            room: self,
            background,
        });
    }
}

impl Combination {
    /// Becomes the subspace of `looks` as the metric of `background`, the one that `room` has taken, sees them.
    pub fn become_of(
        &mut self,
        looks: &[Look],
        background: &Background,
        params: &Params,
        room: &mut Room,
    ) {
        Arch::new().dispatch(BecomeOf {
            combination: self,
            looks,
            background,
            params,
            room,
        });
    }

    #[inline(always)]
    fn become_all<S: Simd>(
        &mut self,
        simd: S,
        looks: &[Look],
        background: &Background,
        params: &Params,
        room: &mut Room,
    ) {
        let (len, count) = (params.feature_len(), looks.len());
        let metric = background.metric();
        let samples = metric.count();
        room.vectors.resize(count * len, 0.0);
        for (look, vector) in looks.iter().zip(room.vectors.chunks_exact_mut(len)) {
            look.write(background.mean(), vector);
        }
        let (vectors, products) = (&room.vectors, &mut room.products);
        products.resize(count * samples, 0.0);
        gemm::multiply(simd, vectors, &room.samples, len, samples, products);
        room.shadows.resize(count * samples, 0.0);
        room.gram.resize(count * count, 0.0);
        gemm::multiply(simd, vectors, vectors, len, count, &mut room.gram);
        let shadow = |i: usize| i * samples..(i + 1) * samples;
        for i in 0..count {
            metric.shadow(&room.products[shadow(i)], &mut room.shadows[shadow(i)]);
        }
        room.scales.clear();
        for i in 0..count {
            for j in 0..count {
                let of_shadows = vector_ops::dot(&room.shadows[shadow(i)], &room.shadows[shadow(j)]);
                let plain = room.gram[i * count + j];
                let product = plain - of_shadows;
                let is_left = i != j || product > plain * LEAST_LEFT;
                room.gram[i * count + j] = if is_left { product } else { 0.0 };
            }
            let square = room.gram[i * count + i];
            room.scales.push(match (params.unit_length, square > 0.0) {
                (true, true) => 1.0 / square.sqrt(),
                (true, false) => 0.0,
                (false, _) => 1.0,
            });
        }
        self.combine(count, params.basis_dim as usize, room);
        self.shadows.clear();
        for row in self.coefficients.chunks_exact(count) {
            let first = self.shadows.len();
            self.shadows.resize(first + samples, 0.0);
            for (i, coefficient) in row.iter().enumerate() {
                let target = &mut self.shadows[first..];
                vector_ops::add(target, *coefficient, &room.shadows[shadow(i)]);
            }
        }
    }

    /// The coefficients, from the Gram matrix of `count` looks and the factors that bring them to their length.
    fn combine(&mut self, count: usize, basis_dim: usize, room: &mut Room) {
        let scale = |i: usize| f64::from(room.scales[i]);
        let gram = |i: usize, j: usize| f64::from(room.gram[i * count + j]) * scale(i) * scale(j);
        let share = 1.0 / count as f64;
        let sum = (0..count * count).map(|at| gram(at / count, at % count));
        self.norm = (sum.sum::<f64>() * share * share).max(0.0);
        self.coefficients.clear();
        self.coefficients
            .extend((0..count).map(|i| (share * scale(i)) as f32));
        room.spectrum.solve(count, gram);
        self.dim = subspace::dominant(room.spectrum.values(), basis_dim);
        for (place, value) in room.spectrum.values().take(self.dim).enumerate() {
            let weight = |i: usize| room.spectrum.weight(place, i) / value.sqrt() * scale(i);
            self.coefficients
                .extend((0..count).map(|i| weight(i) as f32));
        }
    }

    /// ‖μ‖² and the number of basis vectors.
    pub fn size(&self) -> (f64, usize) {
        (self.norm, self.dim)
    }

    /// The shadows of the mean and of the basis vectors.
    pub fn shadows(&self) -> &[f32] {
        &self.shadows
    }

    /// Writes the mean and the basis vectors, before the metric, to `out`, which is as long as they are. `looks` are those
    /// that this was made of; `room` is room for them.
    #[inline(always)]
    pub fn write_to<S: Simd>(
        &self,
        simd: S,
        looks: &[Look],
        background: &Background,
        room: &mut Vec<f32>,
        out: &mut [f32],
    ) {
        let len = out.len() / (1 + self.dim);
        room.resize(looks.len() * len, 0.0);
        for (look, vector) in looks.iter().zip(room.chunks_exact_mut(len)) {
            look.write(background.mean(), vector);
        }
        vector_ops::become_combinations(simd, out, &self.coefficients, room, len);
    }
}
