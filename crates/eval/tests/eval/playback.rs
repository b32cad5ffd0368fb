//! `bagtrack-eval` on sequences that are played backwards, or that begin after a share of their length.

use crate::command::{clip, eval, fails, folder, succeeds, text};
use bagtrack_sample::{Clip, Format, Settings};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

const BOXES: &str = "groundtruth_rect.txt";

/// The report of `eval` without times.
fn report(dir: &Path, args: &[&str]) -> Value {
    let mut all = vec![text(dir), "--seeds", "2", "--format", "json"];
    all.extend(args);
    let mut report: Value = serde_json::from_str(&succeeds(&all)).expect("it is JSON");
    for part in ["/sequences/0", "/mean"] {
        report.pointer_mut(part).expect("it is there")["step_ms"] = Value::Null;
    }
    report
}

/// A copy of a clip under the same name, with the given frames, counted from 1, in the given order.
fn recut(clip: &Path, parent: &Path, frames: impl Iterator<Item = usize>) -> PathBuf {
    let dir = parent.join(clip.file_name().expect("a clip has a name"));
    fs::create_dir_all(dir.join("img")).expect("the folder is writable");
    let boxes = fs::read_to_string(clip.join(BOXES)).expect("it was written");
    let boxes: Vec<&str> = boxes.lines().collect();
    let mut cut = String::new();
    for (index, frame) in frames.enumerate() {
        let from = clip.join(format!("img/{frame:04}.jpg"));
        let to = dir.join(format!("img/{:04}.jpg", index + 1));
        fs::copy(from, to).expect("the frame was written");
        cut += boxes[frame - 1];
        cut.push('\n');
    }
    fs::write(dir.join(BOXES), cut).expect("the folder is writable");
    dir
}

/// Asserts that a copy of a clip with these `frames` is tracked as the clip itself with these `flags`.
fn same(flags: &[&str], frames: impl Iterator<Item = usize>, playback: &Value) {
    let (parent, elsewhere) = (folder(), folder());
    let dir = clip(parent.path(), "clip", 0, 12);
    let copy = recut(&dir, elsewhere.path(), frames);
    let mut played = report(&dir, flags);
    let fields = played.as_object_mut().expect("a report");
    assert_eq!(fields.remove("playback").as_ref(), Some(playback));
    assert_eq!(played, report(&copy, &[]), "{flags:?}");
    // The flags have an effect: without them the results differ.
    let usual = report(&dir, &[]);
    assert_ne!(played["sequences"], usual["sequences"], "{flags:?}");
    assert_eq!(usual.get("playback"), None);
}

fn playback(backwards: bool, start_at: Value, every: Value) -> Value {
    json!({ "backwards": backwards, "start_at": start_at, "every": every, "first_box_error": null })
}

#[test]
fn one_frame_in_four_from_the_first_that_is_played_is_the_clip_with_the_others_left_out() {
    let playback = playback(true, json!(0.1), json!(4));
    let flags = ["--backwards", "--start-at", "0.1", "--every", "4"];
    same(&flags, [10, 6, 2].into_iter(), &playback);
}

#[test]
fn first_boxes_that_are_off_are_told_and_each_seed_has_another() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 12);
    let still = ["motion_std_x=0", "motion_std_y=0", "motion_std_scale=0"];
    let mut flags = vec!["--preset", "paper", "--first-box-error", "0.2"];
    flags.extend(still.iter().flat_map(|set| ["--set", set]));
    let off = report(&dir, &flags);
    assert_eq!(off["playback"]["first_box_error"], 0.2);
    // The boxes stay where they began: with the first seed a fifth of their width right of the target, with the second
    // left of it.
    let errors =
        |report: &Value| [0, 1].map(|seed| report["seed_means"][seed]["center_error"].clone());
    let [first, second] = errors(&off);
    assert_ne!(first, second);
    let exact = report(&dir, &[&flags[..2], &flags[4..]].concat());
    let [first, second] = errors(&exact);
    assert_eq!(first, second);
    let output = eval(&["anywhere", "--first-box-error=0.5"]);
    assert_eq!(output.status.code(), Some(2));
}

/// Frames are decoded in a size that depends on the size of the first box.
#[test]
fn a_first_box_of_another_size_has_frames_of_its_own() {
    let parent = folder();
    let settings = Settings {
        frames: 3,
        width: 640,
        height: 480,
        ..Settings::default()
    };
    let clip = Clip::new(settings).expect("the settings are in order");
    let dir = parent.path().join("large");
    let written = clip.write(&dir, Format::Jpeg, || ());
    written.expect("the folder is writable");
    let flags = [
        "--first-box-error",
        "0.2",
        "--seeds",
        "12",
        "--format",
        "json",
    ];
    let report: Value =
        serde_json::from_str(&succeeds(&[&[text(&dir)], &flags[..]].concat())).unwrap();
    assert_eq!(report["seed_means"].as_array().map(Vec::len), Some(12));
}

#[test]
fn backwards_is_the_clip_with_its_frames_turned_round() {
    let playback = playback(true, Value::Null, Value::Null);
    same(&["--backwards"], (1..=12).rev(), &playback);
}

#[test]
fn a_share_of_the_frames_is_passed_over() {
    let playback = playback(false, json!(0.25), Value::Null);
    same(&["--start-at", "0.25"], 4..=12, &playback);
}

#[test]
fn backwards_the_share_is_counted_from_the_end() {
    let playback = playback(true, json!(0.3), Value::Null);
    let flags = ["--backwards", "--start-at", "0.3"];
    same(&flags, (1..=8).rev(), &playback);
}

#[test]
fn the_run_starts_with_the_box_of_the_last_annotated_frame() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 12);
    // The tracked box stays at the target of the tenth frame, (50, 60); each error is the annotation's distance from
    // there.
    let mut truth = "51,61,40,40\n".to_owned() + &"0,0,0,0\n".repeat(6);
    truth += "54,65,40,40\n51,61,40,40\n51,61,40,40\n0,0,0,0\n0,0,0,0\n";
    fs::write(dir.join(BOXES), truth).expect("the folder is writable");
    let still = ["motion_std_x=0", "motion_std_y=0", "motion_std_scale=0"];
    let mut flags = vec!["--preset", "paper", "--backwards"];
    flags.extend(still.iter().flat_map(|set| ["--set", set]));
    let figures = report(&dir, &flags)["sequences"][0].clone();
    assert_eq!(
        (&figures["frames"], &figures["annotated"]),
        (&json!(10), &json!(4))
    );
    let error = figures["center_error"].as_f64().expect("a number");
    assert!((error - 5.0 / 3.0).abs() < 1e-6, "{error}");
    // If only the first of the frames left is annotated, there is nothing to score.
    flags.extend(["--start-at", "0.5"]);
    let mut args = vec![text(&dir)];
    args.extend(&flags);
    let line = fails(&args);
    assert!(
        line.contains("at least one more must be annotated"),
        "{line}"
    );
    // If none of the frames left is annotated, there is no box to begin with.
    let line = fails(&[text(&dir), "--start-at", "0.9"]);
    assert!(
        line.contains(text(&dir)) && line.contains("from 0.9 of the frames on"),
        "{line}"
    );
}

#[test]
fn the_tables_tell_how_the_sequences_were_played() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", 0, 12);
    let line = "played backwards, from 0.333 of the frames on\n";
    let flags = ["--backwards", "--start-at", "0.333", "--preset", "paper"];
    let args = [&[text(&dir)], &flags[..]].concat();
    assert!(succeeds(&args).contains(line));
    let table = succeeds(&[&args[..], &["--ablate"]].concat());
    assert!(table.starts_with("variant ") && table.contains("\nα = 0.5 "));
    assert!(table.ends_with(line), "{table}");
    assert!(!succeeds(&[text(&dir)]).contains("played"));
}

#[test]
fn a_wrong_share_is_wrong_usage() {
    for share in ["1", "-0.1", "2", "NaN", "half", ""] {
        let output = eval(&["anywhere", &format!("--start-at={share}")]);
        assert_eq!(output.status.code(), Some(2), "{share:?}");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(errors.contains("--start-at"), "{errors}");
    }
}
