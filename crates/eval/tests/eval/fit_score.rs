//! `bagtrack-eval --fit-score`: the coefficients of the score, fitted anew.

use crate::command::{clip, eval, fails, folder, succeeds, text};
use serde_json::Value;
use std::path::Path;

/// Two clips of which every third frame is annotated elsewhere: 16 hits and 7 misses where the target is held.
fn clips(parent: &Path) -> [String; 2] {
    ["one", "two"].map(|name| {
        let seed = if name == "one" { 1 } else { 2 };
        let dir = clip(parent, name, seed, 24);
        let boxes = dir.join("groundtruth_rect.txt");
        let truth = std::fs::read_to_string(&boxes).expect("it was written");
        let lines = truth.lines().enumerate();
        let annotated = lines.map(|(index, line)| match index % 3 {
            0 if index > 0 => "1,1,8,8\n".to_owned(),
            _ => format!("{line}\n"),
        });
        std::fs::write(boxes, annotated.collect::<String>()).expect("the folder is writable");
        text(&dir).to_owned()
    })
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_fit_stands_beside_the_trackers_own_coefficients() {
    let parent = folder();
    let [one, two] = clips(parent.path());
    let fit = |format: &str| {
        succeeds(&[
            &one,
            &two,
            "--fit-score",
            "--seeds",
            "2",
            "--format",
            format,
        ])
    };
    let report: Value = serde_json::from_str(&fit("json")).expect("it is JSON");
    let names = [
        "discriminant",
        "first distance",
        "mean first distance",
        "|ln scale|",
    ];
    assert_eq!(report["predictors"], serde_json::json!(names));
    assert_eq!(
        (&report["frames"], &report["seeds"]),
        (&92.into(), &2.into())
    );
    assert_eq!((&report["hits"], &report["lost"]), (&64.into(), &0.into()));
    for row in [
        &report["tracker"],
        &report["fitted"],
        &report["leaving_one_out"],
    ] {
        assert!((0.3..0.7).contains(&number(&row["roc_auc"])), "{row}");
    }
    // Whatever the frames look like, two of three are hits; the tracker knows nothing of that.
    assert!(number(&report["tracker"]["ece"]) > 0.2);
    assert!(number(&report["fitted"]["ece"]) < 0.1);
    assert!(number(&report["leaving_one_out"]["ece"]) < 0.15);
    // The tracker's row is about the score as it is served.
    let plain = succeeds(&[&one, &two, "--seeds", "2", "--format", "json"]);
    let plain: Value = serde_json::from_str(&plain).expect("it is JSON");
    for field in ["roc_auc", "ece"] {
        let difference = number(&plain["score"][field]) - number(&report["tracker"][field]);
        assert!(difference.abs() < 1e-3, "{field}: {difference}");
    }
    // Leaving out the one of two is fitting the other.
    let alone = succeeds(&[&two, "--fit-score", "--seeds", "2", "--format", "json"]);
    let alone: Value = serde_json::from_str(&alone).expect("it is JSON");
    let left_out = &report["sequences"][0]["fitted"];
    assert_eq!(left_out["coefficients"], alone["fitted"]["coefficients"]);
    assert_eq!(alone["leaving_one_out"], Value::Null);
    let table = fit("table");
    for line in [
        "score ",
        "the tracker's ",
        "fitted ",
        "fitted to the others ",
        "one ",
        "two ",
    ] {
        assert!(
            table.lines().any(|found| found.starts_with(line)),
            "{line}: {table}"
        );
    }
    assert!(table.contains("92 frames, 64 of them hits"), "{table}");
    assert!(fit("markdown").starts_with("| score | intercept | discriminant |"));
}

#[test]
fn what_cannot_be_fitted_is_told() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 12);
    let line = fails(&[text(&dir), "--fit-score", "--preset", "paper"]);
    assert!(
        line.contains("discriminant_weight must be above 0"),
        "{line}"
    );
    let line = fails(&[text(&dir), "--fit-score"]);
    assert!(line.contains("there is nothing to fit"), "{line}");
    let both = eval(&[text(&dir), "--fit-score", "--ablate"]);
    assert_eq!(both.status.code(), Some(2));
}
