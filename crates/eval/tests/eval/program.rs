//! The command line of `bagtrack-eval`, its table for people and its JSON report.

use crate::command::{clip, fails, folder, succeeds, text};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

const FIELDS: [&str; 8] = [
    "frames",
    "annotated",
    "center_error",
    "center_error_sem",
    "precision_20",
    "overlap",
    "success_auc",
    "step_ms",
];

/// The report of these sequences as JSON; `flags` are separated by spaces.
fn report(dirs: &[&PathBuf], flags: &str) -> Value {
    let mut args: Vec<&str> = dirs.iter().map(|dir| text(dir)).collect();
    args.extend(flags.split_whitespace());
    args.extend(["--format", "json"]);
    serde_json::from_str(&succeeds(&args)).expect("it is JSON")
}

fn names(value: &Value) -> Vec<&str> {
    let object = value.as_object().expect("an object");
    sorted(&object.keys().map(String::as_str).collect::<Vec<&str>>())
}

fn sorted<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let mut names = names.to_vec();
    names.sort_unstable();
    names
}

#[test]
fn json_has_exactly_the_promised_fields_and_the_mean_is_the_mean() {
    let parent = folder();
    let one = clip(parent.path(), "one", 1, 12);
    let two = clip(parent.path(), "two", 2, 6);
    let report = report(&[&one, &two], "--preset paper --seeds 3");
    assert_eq!(
        names(&report),
        sorted(&[
            "preset",
            "seeds",
            "sequences",
            "mean",
            "seed_means",
            "worst_seed",
            "score"
        ])
    );
    assert_eq!(
        (&report["preset"], &report["seeds"]),
        (&"paper".into(), &3.into())
    );
    let sequences = report["sequences"].as_array().expect("a list");
    assert_eq!(sequences.len(), 2);
    let mut named = FIELDS.to_vec();
    named.push("name");
    for sequence in sequences {
        assert_eq!(names(sequence), sorted(&named));
    }
    assert_eq!(
        (&sequences[0]["name"], &sequences[1]["name"]),
        (&"one".into(), &"two".into())
    );
    assert_eq!(sequences[1]["frames"], 6);
    assert_eq!(names(&report["mean"]), sorted(&FIELDS));
    let number = |value: &Value| value.as_f64().expect("a number");
    for field in [
        "center_error",
        "precision_20",
        "overlap",
        "success_auc",
        "step_ms",
    ] {
        let mean = (number(&sequences[0][field]) + number(&sequences[1][field])) / 2.0;
        assert!(
            (number(&report["mean"][field]) - mean).abs() < 1e-9,
            "{field}"
        );
    }
    // Standard error of two values: half their difference.
    let difference = number(&sequences[0]["center_error"]) - number(&sequences[1]["center_error"]);
    let sem = number(&report["mean"]["center_error_sem"]);
    assert!((sem - difference.abs() / 2.0).abs() < 1e-9);
    assert_eq!(
        (&report["mean"]["frames"], &report["mean"]["annotated"]),
        (&18.into(), &18.into())
    );
}

#[test]
fn jobs_change_the_time_only() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 12);
    let figures = |jobs: &str| {
        let mut report = report(&[&dir], &format!("--seeds 4 --jobs {jobs}"));
        for part in ["/sequences/0", "/mean"] {
            report.pointer_mut(part).expect("it is there")["step_ms"] = Value::Null;
        }
        report
    };
    assert_eq!(figures("1"), figures("3"));
}

#[test]
fn a_tracker_that_cannot_move_is_measured_as_a_box_that_stays() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 12);
    // The tracked box stays at (50, 60), 40 x 40 pixels. The annotations, frame by frame: the same box, none, moved by
    // (3, 4), moved by 20 to the right, half as wide and high at the same centre, then none.
    let mut truth = "51,61,40,40\n0,0,0,0\n54,65,40,40\n71,61,40,40\n61,71,20,20\n".to_owned();
    truth += &"0,0,0,0\n".repeat(7);
    fs::write(dir.join("groundtruth_rect.txt"), truth).expect("the folder is writable");
    let still = "--set motion_std_x=0 --set motion_std_y=0 --set motion_std_scale=0";
    let report = report(&[&dir], &format!("--seeds 2 {still} --preset paper"));
    let number = |field: &str| report["sequences"][0][field].as_f64().expect("a number");
    let close = |field: &str, expected: f64| {
        assert!(
            (number(field) - expected).abs() < 1e-6,
            "{field} is {}, not {expected}",
            number(field)
        );
    };
    assert_eq!((number("frames"), number("annotated")), (12.0, 4.0));
    close("center_error", (5.0 + 20.0 + 0.0) / 3.0);
    close("center_error_sem", 0.0);
    close("precision_20", 1.0);
    let shifted = 37.0 * 36.0;
    let overlaps = [shifted / (3200.0 - shifted), 800.0 / 2400.0, 400.0 / 1600.0];
    close("overlap", overlaps.iter().sum::<f64>() / 3.0);
    // Of the 21 thresholds 0, 0.05, … 1, the overlap 0.7128 exceeds 15 (up to 0.7), 0.3333 exceeds 7 (up to 0.3), and
    // 0.25 exceeds 5 (up to 0.2).
    close("success_auc", (15.0 + 7.0 + 5.0) / 63.0);
}

#[test]
fn the_table_has_a_row_for_each_sequence_and_the_mean() {
    let parent = folder();
    let dir = clip(parent.path(), "a-long-name-of-a-clip", 0, 12);
    let note = parent.path().join("NOTES.md");
    fs::write(&note, "not a sequence").expect("the folder is writable");
    let table = succeeds(&[text(&dir), text(&note)]);
    let (rows, lines) = table.split_once("\n\n").expect("lines follow the table");
    let rows: Vec<&str> = rows.lines().collect();
    assert_eq!(rows.len(), 3, "{table}");
    assert!(
        rows[0].starts_with("sequence ") && rows[1].starts_with("a-long-name"),
        "{table}"
    );
    assert!(rows[2].starts_with("mean "), "{table}");
    assert!(
        rows.iter().all(|row| row.len() == rows[0].len()),
        "columns are not aligned:\n{table}"
    );
    // With one sequence there is no standard error, and no other sequence to learn the calibration from.
    let lines: Vec<&str> = lines.lines().collect();
    assert_eq!(lines.len(), 2, "{table}");
    assert!(
        lines[0].contains("worst") && lines[0].contains("(seed 0:"),
        "{table}"
    );
    assert!(
        lines[1].starts_with("score against overlap >= 0.5, 11 frames"),
        "{table}"
    );
    assert!(lines[1].ends_with("leaving one sequence out -"), "{table}");
}

#[test]
fn a_broken_sequence_is_told_in_one_line_that_names_the_folder() {
    let parent = folder();
    let good = clip(parent.path(), "good", 0, 12);
    let broken = |name: &str, spoil: &dyn Fn(&std::path::Path)| {
        let dir = clip(parent.path(), name, 0, 12);
        spoil(&dir);
        let line = fails(&[text(&good), text(&dir)]);
        assert!(line.contains(text(&dir)), "{line}");
        line
    };
    let line = fails(&[text(&parent.path().join("nowhere"))]);
    assert!(line.contains("nowhere"), "{line}");
    let line = broken("no-boxes", &|dir| {
        fs::remove_file(dir.join("groundtruth_rect.txt")).expect("it was written");
    });
    assert!(line.contains("groundtruth_rect.txt"), "{line}");
    let line = broken("missing-frame", &|dir| {
        fs::remove_file(dir.join("img/0003.jpg")).expect("it was written");
    });
    assert!(line.contains("11 frames, but 12 lines"), "{line}");
    let line = broken("cut-frame", &|dir| {
        fs::write(dir.join("img/0003.jpg"), [0xFF, 0xD8, 0xFF, 0xE0]).expect("it is writable");
    });
    assert!(line.contains("0003.jpg"), "{line}");
    let line = broken("no-first-box", &|dir| {
        let zeros = "0,0,0,0\n".repeat(12);
        fs::write(dir.join("groundtruth_rect.txt"), zeros).expect("it is writable");
    });
    assert!(line.contains("the first frame is not annotated"), "{line}");
    let line = broken("nonsense", &|dir| {
        fs::write(dir.join("groundtruth_rect.txt"), "one,two\n").expect("it is writable");
    });
    assert!(line.contains("line 1"), "{line}");
    let line = broken("empty", &|dir| {
        fs::remove_dir_all(dir.join("img")).expect("it was written");
    });
    assert!(line.contains("no JPEG, PNG or WebP frames"), "{line}");
}

#[test]
fn the_help_lists_the_parameters_and_the_short_help_points_there() {
    let help = succeeds(&["--help"]);
    assert!(help.contains("\nParameters for --set NAME=VALUE"), "{help}");
    for row in bagtrack_tracker::Params::TABLE {
        assert!(help.contains(&format!("\n  {} ", row.name)), "{}", row.name);
    }
    let short = succeeds(&["-h"]);
    assert!(short.contains("`--help` lists the parameters"), "{short}");
    assert!(!short.contains("Parameters for --set"), "{short}");
}
