//! `bagtrack sample` and `bagtrack track`, as a person types them.

use crate::command::{
    bagtrack, boxes, clip, fails, folder, rows, sample_clip, succeeds, text, track,
};
use bagtrack_tracker::Rect;
use serde_json::Value;
use std::fs;
use std::path::Path;

#[test]
fn sample_writes_the_otb_layout_and_the_same_clip_for_the_same_seed() {
    let parent = folder();
    let one = clip(parent.path(), "one", &["--seed", "7"]);
    let same = clip(parent.path(), "same", &["--seed", "7"]);
    let other = clip(parent.path(), "other", &["--seed", "8"]);
    let truth = fs::read_to_string(one.join("groundtruth_rect.txt")).expect("it was written");
    assert_eq!(truth.lines().count(), 12);
    assert!(
        truth.lines().all(|line| line.split(',').count() == 4),
        "{truth}"
    );
    for index in 1..=12 {
        let name = format!("img/{index:04}.jpg");
        let bytes = |dir: &Path| fs::read(dir.join(&name)).expect("it was written");
        assert_eq!(bytes(&one), bytes(&same), "{name}");
        assert_ne!(bytes(&one), bytes(&other), "{name}");
    }
    assert_eq!(
        fs::read_dir(one.join("img"))
            .expect("it was written")
            .count(),
        12
    );
}

#[test]
fn sample_takes_size_and_format() {
    let parent = folder();
    let dir = clip(
        parent.path(),
        "png",
        &["--width", "200", "--height", "120", "--format", "png"],
    );
    let picture = image::open(dir.join("img/0012.png")).expect("it is a PNG");
    assert_eq!((picture.width(), picture.height()), (200, 120));
}

#[test]
fn sample_draws_the_scene_that_is_asked_for() {
    let parent = folder();
    for (scene, hidden) in [("default", 0), ("covered", 20), ("leaves", 25)] {
        let extra = [
            "--scene", scene, "--frames", "90", "--width", "80", "--height", "64",
        ];
        let dir = clip(parent.path(), scene, &extra);
        let read = |name: &str| fs::read_to_string(dir.join(name)).expect("it was written");
        let (truth, visible) = (read("groundtruth_rect.txt"), read("visible.txt"));
        let count = |text: &str, line: &str| text.lines().filter(|found| *found == line).count();
        assert_eq!(count(&truth, "0,0,0,0"), hidden, "{scene}");
        assert_eq!(
            (count(&visible, "0"), count(&visible, "1")),
            (hidden, 90 - hidden),
            "{scene}"
        );
    }
}

#[test]
fn sample_never_writes_into_a_folder_with_something_in_it() {
    let parent = folder();
    fs::write(parent.path().join("mine.txt"), "keep").expect("the folder is writable");
    let line = fails(&["sample", "--out", text(parent.path())]);
    assert!(line.contains("is not empty"), "{line}");
    assert_eq!(fs::read_dir(parent.path()).expect("it is there").count(), 1);
}

#[test]
fn sample_says_which_setting_is_wrong() {
    let parent = folder();
    let out = parent.path().join("clip");
    let line = fails(&["sample", "--out", text(&out), "--width", "10"]);
    assert!(
        line.contains("width is 10; it must be 64 to 4096"),
        "{line}"
    );
    let line = fails(&["sample", "--out", text(&out), "--frames", "0"]);
    assert!(line.contains("frames is 0"), "{line}");
    let leaves = ["--scene", "leaves", "--frames", "60"];
    let line = fails(&[&["sample", "--out", text(&out)], &leaves[..]].concat());
    assert!(
        line.contains("frames is 60; it must be 90 or more in this scene"),
        "{line}"
    );
    assert!(!out.exists());
}

#[test]
fn track_starts_at_the_given_box_and_gives_one_line_a_frame() {
    let (_parent, dir) = sample_clip();
    let given = |frames: &Path, more: &str| {
        let flags = format!("--format csv --box 44.1,101.4,46.1,57.6 {more}");
        succeeds(&track(frames, &flags))
    };
    let lines = given(&dir, "--seed 3");
    let found = rows(&lines);
    assert_eq!(found.len(), 12);
    assert_eq!(found[0].area, [44.1, 101.4, 46.1, 57.6]);
    let again = given(&dir, "--seed 3");
    assert_eq!(lines, again, "the same seed gives the same boxes");
    assert_ne!(lines, given(&dir, "--seed 4"));
    let pictures = given(&dir.join("img"), "--set seed=3");
    assert_eq!(
        lines, pictures,
        "a folder of frames is as good, and so is --set"
    );
}

#[test]
fn track_takes_the_first_annotated_box_and_counts_from_zero() {
    let (_parent, dir) = sample_clip();
    let truth = fs::read_to_string(dir.join("groundtruth_rect.txt")).expect("it was written");
    let [x, y, width, height] = boxes(&truth)[0];
    let tracked = rows(&succeeds(&["track", text(&dir), "--format", "csv"]));
    let tracked: Vec<[f64; 4]> = tracked.iter().map(|row| row.area).collect();
    for (found, expected) in tracked[0]
        .into_iter()
        .zip([x - 1.0, y - 1.0, width, height])
    {
        assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
    }
    // The card moves by most of its height in these frames; the box must follow.
    let rect = |[x, y, width, height]: [f64; 4]| Rect::new(x, y, width, height);
    let [left, top, width, height] = boxes(&truth)[11];
    let last = Rect::new(left - 1.0, top - 1.0, width, height);
    assert!(rect(tracked[0]).overlap(&last) < 0.4);
    assert!(rect(tracked[11]).overlap(&last) > 0.75, "{tracked:?}");
}

#[test]
fn track_gives_json_lines() {
    let (_parent, dir) = sample_clip();
    let lines = succeeds(&["track", text(&dir), "--format", "json", "--preset", "paper"]);
    let mut count = 0;
    for (index, line) in lines.lines().enumerate() {
        let value: Value = serde_json::from_str(line).expect("each line is JSON");
        assert_eq!(value["frame"], index);
        assert_eq!(value["file"], format!("{:04}.jpg", index + 1));
        assert_eq!(value["target"], 0);
        assert!(value.get("time").is_none(), "{line}");
        for field in ["x", "y", "width", "height"] {
            assert!(value["box"][field].is_f64(), "{line}");
        }
        assert!(
            (0.0..=1.0).contains(&value["score"].as_f64().expect("a number")),
            "{line}"
        );
        let status = value["status"].as_str().expect("a text");
        assert!(
            ["tracking", "uncertain", "lost"].contains(&status),
            "{line}"
        );
        count += 1;
    }
    assert_eq!(count, 12);
}

#[test]
fn track_draws_the_box_and_nothing_else() {
    let (parent, dir) = sample_clip();
    let out = parent.path().join("drawn");
    succeeds(&track(
        &dir,
        &format!("--box 40,100,50,60 --draw {}", text(&out)),
    ));
    assert_eq!(fs::read_dir(&out).expect("it was written").count(), 12);
    let open = |path: std::path::PathBuf| image::open(path).expect("it is a picture").into_rgb8();
    let (plain, drawn) = (open(dir.join("img/0001.jpg")), open(out.join("0001.jpg")));
    let difference = |x, y| -> u32 {
        let (a, b): (&image::Rgb<u8>, &image::Rgb<u8>) =
            (plain.get_pixel(x, y), drawn.get_pixel(x, y));
        a.0.iter()
            .zip(b.0)
            .map(|(a, b)| u32::from(a.abs_diff(b)))
            .sum()
    };
    for (x, y) in [(40, 130), (89, 130), (65, 100), (65, 159)] {
        assert!(difference(x, y) > 60, "no line at {x}, {y}");
    }
    for (x, y) in [(20, 130), (110, 130), (65, 80), (65, 180), (300, 20)] {
        assert!(difference(x, y) < 60, "something at {x}, {y}");
    }
    // `--draw` refuses the folder of the frames, and any folder that is not empty.
    let line = fails(&["track", text(&dir), "--draw", text(&dir.join("img"))]);
    assert!(line.contains("is not empty"), "{line}");
}

#[test]
fn track_warns_of_a_box_that_may_be_two_corners_and_goes_on() {
    let (_parent, dir) = sample_clip();
    let said = |given: &str| {
        let output = bagtrack(&["track", text(&dir), "--box", given]);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stderr).expect("text")
    };
    let warning = said("180,120,260,200");
    assert!(
        warning.contains("outside the frame") && warning.contains("180,120,80,80"),
        "{warning}"
    );
    assert_eq!(said("180,120,80,80"), "");
}

#[test]
fn track_says_in_one_line_what_is_wrong() {
    let (parent, dir) = sample_clip();
    let line = fails(&track(&parent.path().join("nowhere"), "--box 1,2,3,4"));
    assert!(line.contains("nowhere"), "{line}");
    let line = fails(&["track", text(&dir.join("img"))]);
    assert!(line.contains("--box x,y,width,height is needed"), "{line}");
    for (flags, texts) in [
        ("--box 500,500,10,10", ["0001.jpg", "box"]),
        ("--set colour=1", ["there is no such parameter", "alpha"]),
        ("--set alpha=much", ["--set alpha", "much"]),
        ("--set alpha=2", ["alpha is 2; it must be", "from 0 to 1"]),
    ] {
        let line = fails(&track(&dir, flags));
        assert!(texts.iter().all(|text| line.contains(text)), "{line}");
    }
    #[cfg(unix)]
    assert!(fails(&["track", "/dev/null"]).contains("save the video to a file first"));
    let bytes = fs::read(dir.join("img/0005.jpg")).expect("it was written");
    fs::write(dir.join("img/0005.jpg"), &bytes[..bytes.len() / 2]).expect("the folder is writable");
    let line = fails(&["track", text(&dir)]);
    assert!(
        line.contains("0005.jpg") && line.contains("cut short"),
        "{line}"
    );
    let larger = clip(
        parent.path(),
        "larger",
        &["--width", "400", "--height", "300"],
    );
    fs::copy(larger.join("img/0005.jpg"), dir.join("img/0005.jpg")).expect("both are there");
    let line = fails(&["track", text(&dir)]);
    assert!(
        line.contains("0005.jpg: the frame is 400 x 300, the frames before it are 320 x 240"),
        "{line}"
    );
}

#[test]
fn wrong_usage_exits_with_two() {
    for args in [
        ["track", "x", "--box=1,2,3"],
        ["track", "x", "--preset=best"],
    ] {
        let output = bagtrack(&args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
    }
}
