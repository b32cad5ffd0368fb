//! Diagnostics of a step.

use bagtrack_testing::scene::{frame, target};
use bagtrack_tracker::{Preset, Tracker};

#[test]
fn a_step_with_diagnostics_answers_like_one_without() {
    for preset in [Preset::Robust, Preset::Paper] {
        let params = preset.params();
        let mut plain = Tracker::new(&frame(0), target(0), params.clone()).expect("a box inside");
        let mut seeing = plain.clone();
        for t in 1..=30 {
            let expected = plain.step(&frame(t)).expect("frames of one size");
            let (estimate, seen) = seeing
                .step_with_diagnostics(&frame(t))
                .expect("frames of one size");
            assert_eq!(estimate, expected, "frame {t}");
            let weights: Vec<f64> = seen.particles.iter().map(|(_, weight)| *weight).collect();
            assert!(weights.len() >= 20 && weights.iter().all(|weight| *weight >= 0.0));
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            assert!((seen.votes.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            assert!(!seen.votes.is_empty() && seen.votes.len() <= params.bag_size as usize);
            // The answer is the likeliest particle, or the mean of the particles near it.
            let best = seen.particles.iter().max_by(|a, b| a.1.total_cmp(&b.1));
            let (area, _) = best.expect("there are particles");
            let off = area.center_distance(&estimate.target);
            assert!(off < 4.0, "frame {t}: {off} pixels from the answer");
            // Boxes are in the pixels of the uploaded frame.
            if preset == Preset::Robust {
                assert!(area.center_distance(&target(t)) < 8.0, "frame {t}");
            }
        }
        assert_eq!(plain.snapshot(), seeing.snapshot());
    }
}
