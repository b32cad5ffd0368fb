//! The shipped evaluation of candidates against the textbook version, on frames of real videos.

use std::path::{Path, PathBuf};

use bagtrack_cli::{frames, read_boxes};
use bagtrack_testing::textbook;
use bagtrack_tracker::{AffineSubspace, Frame, Params, Preset, Rect, patch};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn gray(path: &Path) -> Frame {
    let luma = image::open(path).expect("a frame that decodes").to_luma8();
    Frame::from_luma(luma.width(), luma.height(), luma.into_raw()).expect("a frame")
}

#[test]
#[ignore = "needs the eight videos: set BAGTRACK_SEQUENCES to their folder"]
fn frames_of_real_video_agree() {
    let root = std::env::var("BAGTRACK_SEQUENCES").expect("BAGTRACK_SEQUENCES is set");
    let params: Params = Preset::Paper.params();
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    let mut folders: Vec<PathBuf> = std::fs::read_dir(&root)
        .expect("the folder of videos")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.join("groundtruth_rect.txt").exists())
        .collect();
    folders.sort();
    assert!(!folders.is_empty(), "no video in {root}");
    for folder in folders {
        let paths = frames::list(&folder).expect("a folder img of frames");
        let boxes = read_boxes(&folder).expect("a ground truth");
        let known: Vec<(&PathBuf, Rect)> = paths
            .iter()
            .zip(boxes)
            .filter_map(|(path, target)| Some((path, target?)))
            .collect();
        // The target's patches in the first annotated frames: enough for a history and a bag.
        let looks: Vec<Vec<f32>> = known
            .iter()
            .take(90)
            .map(|(path, target)| patch(&gray(path), target, &params))
            .collect();
        let slices: Vec<&[f32]> = looks.iter().map(Vec::as_slice).collect();
        let mut greatest = [0.0_f64; 3];
        let mut checked = 0;
        for at in (12..looks.len()).step_by(7) {
            let history: Vec<&[f32]> = slices[at - 5..at].iter().rev().copied().collect();
            let bag: Vec<AffineSubspace> = (0..10)
                .map(|k| (at * k / 10).min(at - 6))
                .map(|from| AffineSubspace::of(&slices[from..from + 6], 3))
                .collect();
            let (path, target) = known[at];
            let frame = gray(path);
            let candidates: Vec<Vec<f32>> = (0..params.particles)
                .map(|_| {
                    let mut shift = |range: f64| (generator.random::<f64>() - 0.5) * range;
                    let (x, y) = target.center();
                    let scale = 1.0 + shift(0.1);
                    let (width, height) = (target.width * scale, target.height * scale);
                    let area = Rect::centered(x + shift(30.0), y + shift(30.0), width, height);
                    patch(&frame, &area, &params)
                })
                .collect();
            let differences = textbook::differences(&candidates, &history, &bag, &params);
            for (sum, value) in greatest.iter_mut().zip(differences) {
                *sum = sum.max(value);
            }
            checked += 1;
        }
        println!(
            "{}: {checked} frames; distances, likelihoods, weights differ by at most {greatest:?}",
            folder.file_name().expect("a name").display()
        );
        assert!(checked > 0);
        assert!(greatest.iter().all(|&difference| difference < 1e-4));
    }
}
