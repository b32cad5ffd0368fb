//! The shipped evaluation against the textbook version: every distance, every likelihood, to 1e-4.

use bagtrack_testing::textbook;
use bagtrack_tracker::{AffineSubspace, Params, Preset};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOLERANCE: f64 = 1e-4;

/// How similar the random vectors of a case are to each other.
#[derive(Debug, Clone, Copy)]
enum Likeness {
    /// Independent vectors.
    Unrelated,
    /// A common pattern with noise of this size, like patches of a video.
    Noisy(f32),
    /// A common pattern plus multiples of a second one, clamped: nearly linearly dependent.
    Dependent,
}

fn likeness() -> impl Strategy<Value = Likeness> {
    prop_oneof![
        Just(Likeness::Unrelated),
        (1e-3_f32..0.3).prop_map(Likeness::Noisy),
        Just(Likeness::Dependent),
    ]
}

struct Source {
    generator: ChaCha8Rng,
    pattern: Vec<f32>,
    other: Vec<f32>,
    likeness: Likeness,
}

impl Source {
    fn new(seed: u64, len: usize, likeness: Likeness) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        let mut pattern = || (0..len).map(|_| generator.random()).collect::<Vec<f32>>();
        let (first, second) = (pattern(), pattern());
        Self {
            generator,
            pattern: first,
            other: second,
            likeness,
        }
    }

    fn vector(&mut self) -> Vec<f32> {
        let share: f32 = self.generator.random();
        let Self {
            generator,
            pattern,
            other,
            likeness,
        } = self;
        pattern
            .iter()
            .zip(other)
            .map(|(&a, &mut b)| match *likeness {
                Likeness::Unrelated => generator.random(),
                Likeness::Noisy(size) => {
                    (a + size * (generator.random::<f32>() - 0.5)).clamp(0.0, 1.0)
                }
                Likeness::Dependent => a + share * (b - a),
            })
            .collect()
    }

    fn vectors(&mut self, count: usize) -> Vec<Vec<f32>> {
        (0..count).map(|_| self.vector()).collect()
    }
}

fn as_slices(vectors: &[Vec<f32>]) -> Vec<&[f32]> {
    vectors.iter().map(Vec::as_slice).collect()
}

fn params() -> impl Strategy<Value = Params> {
    let sides = (4_u32..20, 4_u32..20);
    let sizes = (1_u32..16, 1_u32..=6, 1_u32..=7, 1_u32..12);
    let weights = (0.0_f64..=1.0, prop_oneof![Just(0.01), 0.005..1.0_f64]);
    (sides, sizes, weights).prop_map(|(sides, sizes, weights)| Params {
        patch_width: sides.0,
        patch_height: sides.1,
        particles: sizes.0,
        basis_dim: sizes.1,
        history: sizes.2,
        bag_size: sizes.3,
        alpha: weights.0,
        sigma: weights.1,
        ..Preset::Paper.params()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_vectors_agree(
        params in params(),
        likeness in likeness(),
        seed: u64,
        filled in 0.0_f64..1.0,
    ) {
        let mut source = Source::new(seed, params.feature_len(), likeness);
        let patches = 1 + (filled * f64::from(params.history)) as usize;
        let history = source.vectors(patches.min(params.history as usize));
        let history = as_slices(&history);
        let bag: Vec<AffineSubspace> = (0..params.bag_size)
            .map(|k| {
                let patches = source.vectors(1 + k as usize % (params.history as usize + 1));
                AffineSubspace::of(&as_slices(&patches), params.basis_dim as usize)
            })
            .collect();
        let candidates = source.vectors(params.particles as usize);
        let [distance, likelihood, weight] = textbook::differences(&candidates, &history, &bag, &params);
        prop_assert!(distance < TOLERANCE, "distances differ by {distance}");
        prop_assert!(likelihood < TOLERANCE, "likelihoods differ by {likelihood}");
        prop_assert!(weight < TOLERANCE, "weights differ by {weight}");
    }

    #[test]
    fn a_subspace_has_the_textbook_mean_and_span(
        likeness in likeness(),
        seed: u64,
        count in 1_usize..8,
        basis_dim in 1_usize..=6,
    ) {
        let mut source = Source::new(seed, 80, likeness);
        let patches = source.vectors(count);
        let shipped = AffineSubspace::of(&as_slices(&patches), basis_dim);
        let printed = textbook::Subspace::of(&as_slices(&patches), basis_dim);
        let stored = textbook::Subspace::stored(&shipped);
        prop_assert_eq!(shipped.dim(), printed.basis.ncols());
        let distance = textbook::distance(&stored, &printed, 0.5);
        prop_assert!(distance < 1e-6, "{}", distance);
    }
}

#[test]
fn the_paper_setting_agrees_closely() {
    let params = Preset::Paper.params();
    for (seed, likeness) in [
        Likeness::Unrelated,
        Likeness::Noisy(0.2),
        Likeness::Noisy(0.02),
        Likeness::Noisy(0.004),
    ]
    .into_iter()
    .enumerate()
    {
        let mut source = Source::new(seed as u64, params.feature_len(), likeness);
        let history = source.vectors(5);
        let history = as_slices(&history);
        let bag: Vec<AffineSubspace> = (0..10)
            .map(|_| AffineSubspace::of(&as_slices(&source.vectors(6)), 3))
            .collect();
        let candidates = source.vectors(100);
        let greatest = textbook::differences(&candidates, &history, &bag, &params);
        println!("{likeness:?}: distances, likelihoods, weights differ by {greatest:?}");
        assert!(greatest.iter().all(|&difference| difference < 1e-5));
    }
}

/// The part of a candidate outside the span of the history gives the candidate's own basis direction, however small
/// that part is.
#[test]
fn candidates_nearly_in_the_span_of_the_history_agree() {
    let params = Preset::Paper.params();
    let mut source = Source::new(7, params.feature_len(), Likeness::Noisy(0.1));
    let history = source.vectors(5);
    let history = as_slices(&history);
    let bag: Vec<AffineSubspace> = (0..10)
        .map(|_| AffineSubspace::of(&as_slices(&source.vectors(6)), 3))
        .collect();
    for rest in [1e-1, 1e-2, 1e-3, 1e-4, 0.0] {
        let candidates: Vec<Vec<f32>> = source
            .vectors(params.particles as usize)
            .iter()
            .enumerate()
            .map(|(i, other)| {
                let factor = i as f32 / 20.0;
                let inside = history[1]
                    .iter()
                    .zip(history[2])
                    .map(|(a, b)| factor * (a - b));
                let outside = other.iter().zip(history[3]).map(|(a, b)| rest * (a - b));
                let moved = inside
                    .zip(outside)
                    .map(|(inside, outside)| inside + outside);
                history[0]
                    .iter()
                    .zip(moved)
                    .map(|(h, moved)| h + moved)
                    .collect()
            })
            .collect();
        let greatest = textbook::differences(&candidates, &history, &bag, &params);
        println!("{rest}: distances, likelihoods, weights differ by {greatest:?}");
        assert!(greatest.iter().all(|&difference| difference < 1e-5));
    }
}
