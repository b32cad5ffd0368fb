//! `bagtrack-eval --results`, which writes the boxes as other toolkits read them, and `--frames`, which writes the
//! figures of each frame.

use crate::command::{clip, eval, fails, folder, succeeds, text, tracked};
use bagtrack_cli::parse_boxes;
use bagtrack_tracker::{PREDICTORS, Preset, ScoreModel};
use serde_json::Value;
use std::fs;

#[test]
fn each_sequence_and_seed_has_a_file_of_the_boxes_that_track_gives() {
    let parent = folder();
    let one = clip(parent.path(), "one", 1, 12);
    let two = clip(parent.path(), "two", 2, 6);
    let results = parent.path().join("results");
    let args = [text(&one), text(&two), "--results", text(&results)];
    succeeds(&[&args[..], &["--seeds", "2"]].concat());
    for (dir, seed) in [(&one, 0), (&one, 1), (&two, 0), (&two, 1)] {
        let name = dir.file_name().expect("a folder's name").to_string_lossy();
        let file = results.join(format!("seed-{seed}/{name}.txt"));
        let written = fs::read_to_string(file).expect("the file is there");
        let written = parse_boxes(&written).expect("it has the layout of the benchmark");
        let first = written[0].expect("every frame has a box");
        let mut params = Preset::Robust.params();
        params.seed = seed;
        let tracked = tracked(dir, first, params);
        assert_eq!(written.len(), tracked.len());
        for (written, tracked) in written.iter().zip(tracked) {
            let written = written.expect("every frame has a box");
            assert!(written.overlap(&tracked.target) > 0.999, "{written:?}");
        }
    }
    // The results of a single seed need no folder of their own; existing files are overwritten.
    succeeds(&args);
    let first = fs::read_to_string(results.join("one.txt")).expect("the file is there");
    assert_eq!(
        first,
        fs::read_to_string(results.join("seed-0/one.txt")).expect("it is there")
    );
}

#[test]
fn results_that_would_mislead_are_refused() {
    let parent = folder();
    let one = clip(parent.path(), "clip", 0, 12);
    let other = parent.path().join("other");
    fs::create_dir(&other).expect("the folder is writable");
    let same = clip(&other, "clip", 3, 12);
    let results = parent.path().join("results");
    for flag in ["--results", "--frames"] {
        let message = fails(&[text(&one), text(&same), flag, text(&results)]);
        assert!(
            message.contains("two sequences are called clip"),
            "{message}"
        );
    }
    for flag in [&["--backwards"][..], &["--ablate"], &["--start-at", "0.5"]] {
        let args = [&[text(&one), "--results", text(&results)], flag].concat();
        assert_eq!(eval(&args).status.code(), Some(2), "{flag:?}");
    }
}

#[test]
fn each_scored_frame_has_a_line_with_its_figures_and_what_its_score_is_made_of() {
    let parent = folder();
    let one = clip(parent.path(), "one", 1, 12);
    let two = clip(parent.path(), "two", 2, 6);
    let file = parent.path().join("frames.jsonl");
    let args = [text(&one), text(&two), "--frames", text(&file)];
    let report = succeeds(&[&args[..], &["--seeds", "2", "--format", "json"]].concat());
    let report: Value = serde_json::from_str(&report).expect("it is JSON");
    let written = fs::read_to_string(&file).expect("the file is there");
    let line = |line| serde_json::from_str(line).expect("it is a line of JSON");
    let lines: Vec<Value> = written.lines().map(line).collect();
    assert_eq!(lines.len(), 2 * (11 + 5));
    assert_eq!(report["score"]["frames"], lines.len());
    for (index, sequence) in ["one", "two"].iter().enumerate() {
        for field in ["center_error", "overlap"] {
            let of_sequence = lines.iter().filter(|line| line["sequence"] == *sequence);
            let values: Vec<f64> = of_sequence
                .filter_map(|line| line[field].as_f64())
                .collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let reported = report["sequences"][index][field].as_f64();
            assert!((mean - reported.expect("a number")).abs() < 1e-9, "{field}");
        }
    }
    for line in &lines {
        let predictors: [f64; PREDICTORS.len()] =
            serde_json::from_value(line["predictors"].clone()).expect("there is a discriminant");
        let score = ScoreModel::TRACKER.score(&predictors, line["status"] == "lost");
        let served = line["score"].as_f64().expect("a number");
        assert!((score - served).abs() < 1e-6, "{line}");
    }
    // Without a discriminant there are no predictors of the score.
    succeeds(&[text(&one), "--preset", "paper", "--frames", text(&file)]);
    let written = fs::read_to_string(&file).expect("the file is there");
    assert!(written.lines().count() == 11 && written.contains("\"predictors\":null"));
    let both = eval(&[text(&one), "--frames", text(&file), "--ablate"]);
    assert_eq!(both.status.code(), Some(2));
}
