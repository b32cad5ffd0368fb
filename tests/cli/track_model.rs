//! `bagtrack track --model`: a second opinion by a network that the user gives.

use crate::command::{bagtrack, fails, sample_clip, succeeds, text};
use bagtrack_testing::tiny_network;
use std::path::PathBuf;
use tempfile::TempDir;

const ONE: &str = "--box=44.1,101.4,46.1,57.6";

/// A folder, the sample clip in it, and the flag that names a network there.
fn clip_and_model() -> (TempDir, PathBuf, String) {
    let (parent, dir) = sample_clip();
    let model = tiny_network::write(parent.path()).expect("the folder is writable");
    (parent, dir, format!("--model={model}"))
}

#[test]
fn a_network_has_a_part_in_the_boxes_and_leaves_none_without_it() {
    let (_parent, dir, model) = clip_and_model();
    let with = succeeds(&["track", text(&dir), ONE, &model]);
    let without = succeeds(&["track", text(&dir), ONE]);
    assert_ne!(with, without);
    assert_eq!(succeeds(&["track", text(&dir), ONE, &model]), with);
    assert_eq!(with.lines().count(), without.lines().count());
}

#[test]
fn a_network_for_doubt_leaves_the_sure_frames_as_they_are() {
    let (_parent, dir, model) = clip_and_model();
    let track = ["track", text(&dir), ONE];
    let in_doubt = succeeds(&[&track[..], &[&model, "--model-in-doubt"]].concat());
    let always = succeeds(&[&track[..], &[&model]].concat());
    let without = succeeds(&track);
    let same = |one: &str, other: &str| {
        one.lines()
            .zip(other.lines())
            .filter(|(a, b)| a == b)
            .count()
    };
    let (as_without, as_always) = (same(&in_doubt, &without), same(&in_doubt, &always));
    assert!(
        as_without > as_always && as_without > 5,
        "{as_without} {as_always}"
    );
    let alone = bagtrack(&[&track[..], &["--model-in-doubt"]].concat());
    let errors = String::from_utf8_lossy(&alone.stderr);
    assert!(
        alone.status.code() == Some(2) && errors.contains("--model <"),
        "{errors}"
    );
}

#[test]
fn a_network_that_cannot_be_used_is_told_before_a_frame_is_tracked() {
    let (_parent, dir, model) = clip_and_model();
    let files = model.strip_prefix("--model=nanotrack:");
    let (backbone, head) = files
        .and_then(|files| files.split_once(','))
        .expect("two files");
    let refusal = |model: &str| fails(&["track", text(&dir), ONE, "--model", model]);
    let missing = refusal(&format!("nanotrack:{backbone}.gone,{head}"));
    assert!(missing.contains("backbone.onnx.gone"), "{missing}");
    let swapped = refusal(&format!("nanotrack:{head},{backbone}"));
    assert!(swapped.contains("no NanoTrack"), "{swapped}");
    let no_network = format!(
        "nanotrack:{},{head}",
        text(&dir.join("groundtruth_rect.txt"))
    );
    let refused = refusal(&no_network);
    assert!(refused.contains("not an ONNX file"), "{refused}");
    let paper = ["track", text(&dir), ONE, "--preset=paper"];
    let refused = fails(&[&paper[..], &[&model]].concat());
    assert!(refused.contains("robust"), "{refused}");
}
