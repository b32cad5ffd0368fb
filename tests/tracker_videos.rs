//! The accuracy that is promised for the default parameters, on the eight videos.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use bagtrack::eval::{self, Report, Sequence};
use bagtrack::ingest::Limits;
use bagtrack::tracker::Preset;

/// Over the eight videos, in pixels of their frames.
const GREATEST_CENTER_ERROR: f64 = 10.0;
const LEAST_OVERLAP: f64 = 0.66;

#[test]
#[ignore = "needs the eight videos: set BAGTRACK_SEQUENCES to their folder"]
fn the_default_parameters_hold_the_targets_of_the_eight_videos() {
    let root = std::env::var("BAGTRACK_SEQUENCES").expect("BAGTRACK_SEQUENCES is set");
    let mut folders: Vec<PathBuf> = std::fs::read_dir(&root)
        .expect("the folder of videos")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.join(Sequence::BOXES).exists())
        .collect();
    folders.sort();
    assert_eq!(folders.len(), 8, "videos in {root}");
    let preset = Preset::default();
    let runs = folders.iter().map(|folder| {
        let sequence = Sequence::load(folder, &Limits::default()).expect("a whole video");
        let one = NonZeroUsize::MIN;
        eval::run(&sequence, &preset.params(), one, one).expect("a box in every first frame")
    });
    let runs: Vec<_> = runs.collect();
    let report = Report::new(preset, &runs).expect("eight videos");
    let (error, overlap) = (report.mean().center_error, report.mean().overlap);
    println!("{report}");
    assert!(error <= GREATEST_CENTER_ERROR, "centre error {error}");
    assert!(overlap >= LEAST_OVERLAP, "overlap {overlap}");
}
