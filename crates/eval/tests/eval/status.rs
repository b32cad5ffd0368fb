//! The status with the default parameters, on clips in which the target goes behind a post or out of the frame: `lost`
//! soon after the target is out of sight, never `tracking` on something else, and `tracking` again, without help, some
//! time after it came back.

use bagtrack_sample::{Clip, Scene, Settings};
use bagtrack_tracker::{Estimate, Frame, Preset, ScoreModel, Status, Tracker};

/// Most frames until the status follows a change: a quarter of a second of a usual video.
const NOTICED: u32 = 6;
/// The target is out of sight for 20 or 25 frames; at least so many of their answers must be `lost`, and the others
/// `uncertain`.
const LEAST_LOST: u32 = 10;
/// The last frames of a clip, in which the target must have been found again.
const END: u32 = 20;

fn frame(clip: &Clip, index: u32) -> Frame {
    let picture = clip.draw(index);
    let luma = picture.pixels().map(|pixel| {
        let [red, green, blue] = pixel.0.map(f32::from);
        (0.299 * red + 0.587 * green + 0.114 * blue).round() as u8
    });
    let luma = luma.collect();
    Frame::from_luma(picture.width(), picture.height(), luma).expect("a whole picture")
}

/// The answers to all frames but the first.
fn follow(clip: &Clip, frames: &[Frame], seed: u64) -> Vec<Estimate> {
    let params = bagtrack_tracker::Params {
        seed,
        ..Preset::default().params()
    };
    let mut tracker = Tracker::new(&frames[0], clip.target(0), params).expect("a box inside");
    let further = frames[1..].iter().map(|frame| tracker.step(frame));
    further
        .map(|answer| answer.expect("frames of one size"))
        .collect()
}

#[test]
fn a_covered_target_is_lost_and_found_again() {
    is_lost_and_found_again(Scene::Covered);
}

#[test]
fn a_target_that_leaves_the_frame_is_lost_and_found_again() {
    is_lost_and_found_again(Scene::Leaves);
}

fn is_lost_and_found_again(scene: Scene) {
    let clip = Clip::new(Settings {
        scene,
        ..Settings::default()
    })
    .expect("the settings are in order");
    // The frames are drawn once for all seeds, because drawing takes longer than tracking.
    let frames: Vec<_> = (0..clip.frames())
        .map(|index| frame(&clip, index))
        .collect();
    for seed in 0..6 {
        let (mut hidden, mut lost) = (0, 0);
        for answer in follow(&clip, &frames, seed) {
            let index = u32::try_from(answer.frame).expect("a short clip");
            let overlap = clip.target(index).overlap(&answer.target);
            let status = answer.status;
            hidden = if clip.visible(index) > 0.0 {
                0
            } else {
                hidden + 1
            };
            if hidden > NOTICED {
                assert_ne!(status, Status::Tracking, "seed {seed}, frame {index}");
                assert!(answer.score < 0.5, "seed {seed}, frame {index}");
            }
            lost += u32::from(hidden > 0 && status == Status::Lost);
            if status == Status::Tracking {
                assert!(overlap > 0.3, "seed {seed}, frame {index}: {overlap}");
            }
            if index + END >= clip.frames() {
                assert_eq!(status, Status::Tracking, "seed {seed}, frame {index}");
                assert!(overlap > 0.5, "seed {seed}, frame {index}: {overlap}");
            }
        }
        assert!(lost >= LEAST_LOST, "seed {seed}: lost in {lost} frames");
    }
}

#[test]
fn the_score_is_what_its_model_makes_of_the_evidence() {
    let clip = Clip::new(Settings {
        scene: Scene::Covered,
        ..Settings::default()
    })
    .expect("the settings are in order");
    let start = |preset: Preset| {
        let first = frame(&clip, 0);
        Tracker::new(&first, clip.target(0), preset.params()).expect("a box inside")
    };
    let mut tracker = start(Preset::Robust);
    assert_eq!(tracker.evidence(), None);
    let mut lost = 0;
    for index in 1..clip.frames() {
        let answer = tracker.step(&frame(&clip, index)).expect("one size");
        let evidence = tracker.evidence().expect("it was given by a step");
        let is_lost = answer.status == Status::Lost;
        let predictors = evidence.predictors().expect("there is a discriminant");
        let score = ScoreModel::TRACKER.score(&predictors, is_lost);
        assert_eq!(score as f32, answer.score, "frame {index}");
        let scale = answer.target.width / clip.target(0).width;
        assert!((evidence.scale - scale).abs() < 1e-9, "frame {index}");
        assert!(evidence.nearest_distance <= evidence.first_distance);
        lost += u32::from(is_lost);
    }
    assert!(lost >= LEAST_LOST);
    let restored = Tracker::restore(&tracker.snapshot()).expect("an own snapshot");
    assert_eq!(restored.evidence(), None);
    let last = clip.frames() - 1;
    tracker
        .retarget(&frame(&clip, last), clip.target(last))
        .expect("a box inside");
    assert_eq!(tracker.evidence(), None);
    let mut paper = start(Preset::Paper);
    paper.step(&frame(&clip, 1)).expect("one size");
    let evidence = paper.evidence().expect("it was given by a step");
    assert_eq!((evidence.discriminant, evidence.predictors()), (None, None));
}
