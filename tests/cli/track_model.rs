//! `bagtrack track --model`: a second opinion by a network that the user gives.

use crate::command::{bagtrack, clip, fails, folder, succeeds, text};
use bagtrack_testing::tiny_network;
use std::fs;
use std::path::{Path, PathBuf};

const ONE: &str = "--box=44.1,101.4,46.1,57.6";

/// The two files of a network in `folder`.
fn network(folder: &Path) -> [PathBuf; 2] {
    let files = [folder.join("backbone.onnx"), folder.join("head.onnx")];
    fs::write(&files[0], tiny_network::backbone()).unwrap();
    fs::write(&files[1], tiny_network::head()).unwrap();
    files
}

#[test]
fn a_network_has_a_part_in_the_boxes_and_leaves_none_without_it() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let [backbone, head] = network(parent.path());
    let model = format!("--model=nanotrack:{},{}", text(&backbone), text(&head));
    let with = succeeds(&["track", text(&dir), ONE, &model]);
    let without = succeeds(&["track", text(&dir), ONE]);
    assert_ne!(with, without);
    assert_eq!(succeeds(&["track", text(&dir), ONE, &model]), with);
    assert_eq!(with.lines().count(), without.lines().count());
}

#[test]
fn a_network_for_doubt_leaves_the_sure_frames_as_they_are() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let [backbone, head] = network(parent.path());
    let model = format!("--model=nanotrack:{},{}", text(&backbone), text(&head));
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
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let [backbone, head] = network(parent.path());
    let (backbone, head) = (text(&backbone), text(&head));
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
    let paper = ["track", text(&dir), ONE, "--preset=paper", "--model"];
    let model = format!("nanotrack:{backbone},{head}");
    let refused = fails(&[&paper[..], &[&model]].concat());
    assert!(refused.contains("robust"), "{refused}");
}
