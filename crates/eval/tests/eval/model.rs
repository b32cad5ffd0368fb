//! `bagtrack-eval --model`: the tracker is measured with an expert beside it.

use crate::command::{clip, fails, folder, succeeds, text};
use bagtrack_siamese::NanoTrack;
use bagtrack_testing::tiny_network;
use bagtrack_tracker::{Expert, Preset};
use serde_json::Value;
use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;

#[test]
fn a_network_has_a_part_in_the_figures() {
    let parent = folder();
    let one = clip(parent.path(), "one", 1, 12);
    let model = tiny_network::write(parent.path()).unwrap();
    let overlap = |args: &[&str]| {
        let json = succeeds(&[&[text(&one), "--format", "json"], args].concat());
        let report: Value = serde_json::from_str(&json).expect("it is JSON");
        report["mean"]["overlap"].as_f64().expect("a number")
    };
    let (with, without) = (overlap(&["--model", &model]), overlap(&[]));
    assert!(with != without && with > 0.3, "{with} {without}");
    let missing = format!("{model}.gone");
    let refused = fails(&[text(&one), "--model", &missing]);
    assert!(refused.contains("head.onnx.gone"), "{refused}");
}

/// With the files that `BAGTRACK_NANOTRACK` names, on an annotated sequence.
#[test]
#[ignore = "needs the annotated sequences (BAGTRACK_SEQUENCES) and NanoTrack's files (BAGTRACK_NANOTRACK=BACKBONE,HEAD)"]
fn nanotrack_itself_keeps_the_filter_on_a_can_that_turns() {
    let sequences = PathBuf::from(std::env::var("BAGTRACK_SEQUENCES").expect("the folder"));
    let files = std::env::var("BAGTRACK_NANOTRACK").expect("the two files");
    let (backbone, head) = files.split_once(',').expect("a comma between");
    let network = NanoTrack::from_onnx(&fs::read(backbone).unwrap(), &fs::read(head).unwrap());
    let network: Arc<dyn Expert> = Arc::new(network.expect("NanoTrack's two files"));
    let coke = sequences.join("Coke");
    let sequence = bagtrack_eval::Sequence::load(&coke, &Default::default()).unwrap();
    let params = Preset::Robust.params();
    let runs = bagtrack_eval::run(
        &sequence,
        &params,
        Some(&network),
        NonZeroUsize::MIN,
        NonZeroUsize::MIN,
    );
    let scored = &runs.unwrap().seeds[0].scored;
    let overlap = scored.iter().map(|frame| frame.overlap).sum::<f64>() / scored.len() as f64;
    assert!(overlap > 0.7, "{overlap}");
}
