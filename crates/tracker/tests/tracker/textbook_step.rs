//! The printed `step` over time: the weights and the answer of each frame against the textbook version, which keeps its
//! own history and bag, and the next particles against the weights.

use std::collections::VecDeque;

use bagtrack_testing::scene::{frame, target};
use bagtrack_tracker::{AffineSubspace, Frame, Params, Preset, Rect, Tracker, patch};

/// The state of the textbook version between frames.
struct Memory {
    params: Params,
    /// Newest first.
    history: VecDeque<Vec<f32>>,
    /// Oldest first.
    bag: VecDeque<AffineSubspace>,
}

impl Memory {
    fn of(frame: &Frame, target: &Rect, params: &Params) -> Self {
        let mut memory = Self {
            params: params.clone(),
            history: VecDeque::new(),
            bag: VecDeque::new(),
        };
        memory.learn(frame, target, 0);
        memory
    }

    fn history(&self) -> Vec<&[f32]> {
        self.history.iter().map(Vec::as_slice).collect()
    }

    /// Section III-C: the bag takes the answer's subspace every W frames, in place of the oldest when it is full.
    fn learn(&mut self, frame: &Frame, answer: &Rect, number: u32) {
        let params = &self.params;
        let newest = patch(frame, answer, params);
        if number.is_multiple_of(params.update_every) {
            let mut columns = vec![newest.as_slice()];
            columns.extend(self.history.iter().map(Vec::as_slice));
            let latest = AffineSubspace::of(&columns, params.basis_dim as usize);
            self.bag.push_back(latest);
            if self.bag.len() > params.bag_size as usize {
                self.bag.pop_front();
            }
        }
        self.history.push_front(newest);
        self.history.truncate(params.history as usize);
    }
}

#[test]
fn every_frame_has_the_textbook_weights_and_answer() {
    let params = Params {
        particles: 40,
        patch_width: 16,
        patch_height: 12,
        // With three entries the bag is full after ten frames.
        bag_size: 3,
        ..Preset::Paper.params()
    };
    assert_eq!((params.history, params.update_every), (5, 5));
    let mut tracker = Tracker::new(&frame(0), target(0), params.clone()).expect("a box inside");
    let mut memory = Memory::of(&frame(0), &target(0), &params);
    for number in 1..36 {
        let frame = frame(number as usize);
        let answer = tracker.step(&frame).expect("frames of one size").target;
        let (boxes, weights): (Vec<Rect>, Vec<f64>) = tracker.particles().unzip();
        let candidates: Vec<Vec<f32>> = boxes
            .iter()
            .map(|area| patch(&frame, area, &params))
            .collect();
        let bag = memory.bag.make_contiguous().to_vec();
        let textbook =
            bagtrack_testing::textbook::evaluate(&candidates, &memory.history(), &bag, &params);
        assert_eq!(weights.len(), textbook.weights.len());
        for (i, (weight, expected)) in weights.iter().zip(&textbook.weights).enumerate() {
            let difference = (weight - expected).abs();
            assert!(
                difference < 1e-5,
                "frame {number}, particle {i}: {difference}"
            );
        }
        // The answer has the greatest weight; rounding may make another particle of nearly the same weight the answer.
        let greatest = textbook.weights.iter().copied().fold(0.0, f64::max);
        let chosen = boxes.iter().position(|area| *area == answer);
        let chosen = chosen.expect("the answer is a particle");
        assert!(textbook.weights[chosen] > greatest - 1e-5, "frame {number}");
        memory.learn(&frame, &answer, number);
    }
    assert_eq!((memory.history.len(), memory.bag.len()), (5, 3));
}

/// The distance between the weighted means of `found` and `from`, in standard errors of a mean of as many draws from
/// `from`, each with noise of the standard deviation `std` added.
fn deviation(found: &[(f64, f64)], from: &[(f64, f64)], std: f64) -> f64 {
    let mean = |cloud: &[(f64, f64)]| cloud.iter().map(|(x, w)| x * w).sum::<f64>();
    let middle = mean(from);
    let spread = from.iter().map(|(x, w)| w * (x - middle).powi(2));
    let variance = spread.sum::<f64>() + std * std;
    let drawn = found.iter().map(|(x, _)| x).sum::<f64>() / found.len() as f64;
    (drawn - middle) / (variance / found.len() as f64).sqrt()
}

#[test]
fn the_next_particles_are_drawn_by_the_weights() {
    let params = Params {
        particles: 1000,
        patch_width: 8,
        patch_height: 8,
        ..Preset::Paper.params()
    };
    let std = params.motion_std_x;
    let centers = |tracker: &Tracker| -> Vec<(f64, f64)> {
        let particles = tracker.particles();
        particles.map(|(area, w)| (area.center().0, w)).collect()
    };
    let mut tracker = Tracker::new(&frame(0), target(0), params).expect("a box inside");
    let (mut by_weight, mut by_none) = (0.0, 0.0);
    let frames = 1..41;
    for number in frames.clone() {
        let before = centers(&tracker);
        let sum: f64 = before.iter().map(|(_, weight)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-9, "frame {number}: {sum}");
        tracker.step(&frame(number)).expect("frames of one size");
        let after = centers(&tracker);
        by_weight += deviation(&after, &before, std).powi(2);
        let share = 1.0 / before.len() as f64;
        let equal: Vec<(f64, f64)> = before.iter().map(|&(x, _)| (x, share)).collect();
        by_none += deviation(&after, &equal, std).powi(2);
    }
    // The square of a standard normal number has the mean 1; the mean of forty squares has the standard error 0.22.
    let (by_weight, by_none) = (
        by_weight / frames.len() as f64,
        by_none / frames.len() as f64,
    );
    assert!((0.1..1.9).contains(&by_weight), "{by_weight}");
    assert!(
        by_none > 4.0,
        "weights that say nothing show nothing: {by_none}"
    );
}

#[test]
fn particles_restart_at_a_box_that_is_given() {
    let mut tracker = Tracker::new(&frame(0), target(0), Preset::Paper.params()).expect("a box");
    let all_at = |tracker: &Tracker, expected: Rect| {
        assert_eq!(tracker.particles().len(), 100);
        for (area, weight) in tracker.particles() {
            assert!(area.center_distance(&expected) < 1e-9, "{area:?}");
            assert!((area.width - expected.width).abs() < 1e-9, "{area:?}");
            assert!((weight - 0.01).abs() < 1e-12);
        }
    };
    all_at(&tracker, target(0));
    tracker.step(&frame(1)).expect("frames of one size");
    let box_given = Rect::new(40.0, 30.0, 30.0, 20.0);
    tracker
        .retarget(&frame(2), box_given)
        .expect("a box inside");
    all_at(&tracker, box_given);
    let robust = Tracker::new(&frame(0), target(0), Preset::Robust.params()).expect("a box");
    assert_eq!(robust.particles().len(), 0);
}
