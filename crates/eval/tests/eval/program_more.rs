//! The report of `bagtrack-eval` beyond the means: each seed, the score's quality, variants side by side.

use crate::command::{clip, folder, succeeds, text, tracked};
use bagtrack_cli::{assign, parse_assignment};
use bagtrack_testing::command::program;
use bagtrack_tracker::{Preset, Rect};
use serde_json::Value;
use std::cmp::Ordering;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

fn json(args: &[&str]) -> Value {
    let mut all = vec!["--format", "json"];
    all.extend(args);
    serde_json::from_str(&succeeds(&all)).expect("it is JSON")
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

fn close(found: &Value, expected: f64) {
    assert!(
        (number(found) - expected).abs() < 1e-9,
        "{found}, not {expected}"
    );
}

/// Two clips on which different seeds give different results.
fn clips(parent: &Path) -> [String; 2] {
    ["one", "two"].map(|name| {
        let seed = if name == "one" { 1 } else { 2 };
        let dir = clip(parent, name, seed, 15);
        text(&dir).to_owned()
    })
}

#[test]
fn seed_means_are_means_over_the_sequences_and_the_worst_is_among_them() {
    let parent = folder();
    let [one, two] = clips(parent.path());
    let report = json(&[&one, &two, "--preset", "paper", "--seeds", "3"]);
    let means = report["seed_means"].as_array().expect("a list");
    assert_eq!(means.len(), 3);
    for field in ["center_error", "overlap", "precision_20"] {
        let sum: f64 = means.iter().map(|mean| number(&mean[field])).sum();
        close(&report["mean"][field], sum / 3.0);
    }
    // The figures of the first seed are those of an evaluation with one seed.
    let single = json(&[&one, &two, "--preset", "paper", "--seeds", "1"]);
    assert_eq!(single["seed_means"][0], means[0]);
    close(
        &single["mean"]["center_error"],
        number(&means[0]["center_error"]),
    );
    let worst = &report["worst_seed"];
    assert!(means.contains(worst));
    assert!(
        means
            .iter()
            .all(|mean| number(&mean["center_error"]) <= number(&worst["center_error"]))
    );
    assert!(
        means
            .iter()
            .any(|mean| mean["center_error"] != means[0]["center_error"]),
        "{means:?}"
    );
    for (index, mean) in means.iter().enumerate() {
        assert_eq!(mean["seed"], index);
        assert_eq!(mean.as_object().expect("an object").len(), 4);
    }
}

#[test]
fn the_score_is_held_against_the_overlap() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 15);
    let still = ["motion_std_x=0", "motion_std_y=0", "motion_std_scale=0"];
    let mut args = vec![text(&dir), "--preset", "paper", "--seeds", "2"];
    args.extend(still.iter().flat_map(|set| ["--set", set]));
    // The tracked box stays, and all annotations but those of the first two frames are elsewhere: 1 hit of 14 with each
    // seed.
    let mut truth = "51,61,40,40\n52,61,40,40\n".to_owned();
    truth += &"201,161,40,40\n".repeat(13);
    fs::write(dir.join("groundtruth_rect.txt"), &truth).expect("the folder is writable");
    let score = json(&args)["score"].clone();
    assert_eq!(score["frames"], 28);
    assert_eq!(score["ece_leave_one_out"], Value::Null);
    // The expected figure, from the tracker's own scores: the share of misses with a lower score than the hit.
    let scores = [0, 1].map(|seed| {
        let set: Vec<_> = still.iter().map(|set| parse_assignment(set)).collect();
        let set = set.into_iter().collect::<Result<Vec<_>, _>>();
        let set = set.expect("each is NAME=VALUE");
        let mut params = assign(&Preset::Paper.params(), &set).expect("they are in their ranges");
        params.seed = seed;
        let answers = tracked(&dir, Rect::new(50.0, 60.0, 40.0, 40.0), params);
        let scores = answers[1..].iter().map(|answer| f64::from(answer.score));
        scores.collect::<Vec<f64>>()
    });
    let misses = || scores.iter().flat_map(|scores| &scores[1..]);
    let won = scores.iter().flat_map(|scores| {
        misses().map(|miss| match scores[0].total_cmp(miss) {
            Ordering::Less => 0.0,
            Ordering::Equal => 0.5,
            Ordering::Greater => 1.0,
        })
    });
    close(&score["roc_auc"], won.sum::<f64>() / (2.0 * 26.0));
    let error = number(&score["ece"]);
    // With misses alone there is no ROC curve, and the calibration error is the mean score.
    let truth = truth.replace("52,61,40,40", "201,161,40,40");
    fs::write(dir.join("groundtruth_rect.txt"), truth).expect("the folder is writable");
    let misses = json(&args)["score"].clone();
    assert_eq!(misses["roc_auc"], Value::Null);
    assert!(number(&misses["ece"]) > error, "{misses} after {score}");
    let mean = scores.concat().iter().sum::<f64>() / 28.0;
    assert!(
        (number(&misses["ece"]) - mean).abs() < 1e-6,
        "{misses}, not {mean}"
    );
    // With two sequences, the calibration of each can be learned from the other.
    let other = clip(parent.path(), "other", 0, 15);
    let mut both = args.clone();
    both.push(text(&other));
    let score = json(&both)["score"].clone();
    let learnt = number(&score["ece_leave_one_out"]);
    assert!((0.0..=1.0).contains(&learnt), "{score}");
    assert_eq!(score["frames"], 56);
}

#[test]
fn the_ablation_has_the_preset_first_and_a_row_for_each_change() {
    let parent = folder();
    let [one, two] = clips(parent.path());
    let common = [&*one, &*two, "--preset", "paper", "--seeds", "2"];
    let mut args = common.to_vec();
    args.push("--ablate");
    let table = json(&args);
    let rows = table["variants"].as_array().expect("a list");
    assert_eq!(
        (&rows[0]["label"], &rows[0]["set"]),
        (&"paper".into(), &serde_json::json!({}))
    );
    assert_eq!(
        (&table["sequences"], &table["seeds"]),
        (&serde_json::json!(["one", "two"]), &2.into())
    );
    let plain = json(&common);
    for field in [
        "center_error",
        "center_error_sem",
        "precision_20",
        "overlap",
        "success_auc",
    ] {
        assert_eq!(rows[0][field], plain["mean"][field], "{field}");
    }
    for field in ["worst_seed", "score"] {
        assert_eq!(rows[0][field], plain[field]);
    }
    for alpha in [0, 1] {
        let row = rows
            .iter()
            .find(|row| row["set"] == serde_json::json!({ "alpha": alpha }))
            .expect("the paper's ablation is in it");
        let set = format!("alpha={alpha}");
        let mut args = common.to_vec();
        args.extend(["--set", &*set]);
        assert_eq!(row["center_error"], json(&args)["mean"]["center_error"]);
        assert_ne!(row["center_error"], rows[0]["center_error"]);
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let parent = folder();
    let clip = clip(parent.path(), "clip", 0, 12);
    let mut eval = Command::new(program("bagtrack-eval"))
        .args(["--preset", "paper", text(&clip)])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("cargo has built the binary");
    drop(eval.stdout.take());
    let output = eval.wait_with_output().expect("it ends");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert_eq!(errors, "");
}
