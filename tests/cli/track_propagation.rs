//! Propagating a box from a key frame: for a number of frames, backwards, until it is lost, and as key frames only.

use crate::command::{Row, clip, fails, folder, rows, succeeds, text, track, video_of};
use std::fs;
use std::path::{Path, PathBuf};

/// A clip of the sample of 80 frames, and `--box` for the target in this frame of it.
fn long_clip(parent: &Path, frame: usize) -> (PathBuf, String) {
    let dir = clip(parent, "clip", &["--frames", "80"]);
    (dir.clone(), box_of(&dir, frame))
}

fn truth(dir: &Path) -> Vec<[f64; 4]> {
    let text = fs::read_to_string(dir.join("groundtruth_rect.txt")).expect("the sample has it");
    let mut boxes = crate::command::boxes(&text);
    for corner in &mut boxes {
        corner[0] -= 1.0;
        corner[1] -= 1.0;
    }
    boxes
}

fn box_of(dir: &Path, frame: usize) -> String {
    let [x, y, width, height] = truth(dir)[frame];
    format!("--box={x},{y},{width},{height}")
}

fn frames(rows: &[Row]) -> Vec<u64> {
    rows.iter().map(|row| row.frame).collect()
}

/// How far the centre of a row is from the truth.
fn error(row: &Row, truth: &[[f64; 4]]) -> f64 {
    let centre = |area: [f64; 4]| (area[0] + area[2] / 2.0, area[1] + area[3] / 2.0);
    let (a, b) = (centre(row.area), centre(truth[row.frame as usize]));
    (a.0 - b.0).hypot(a.1 - b.1)
}

#[test]
fn a_box_goes_so_many_frames_forwards_or_back_to_the_first() {
    let parent = folder();
    let (dir, target) = long_clip(parent.path(), 30);
    let tracked = |more: &str| {
        let flags = format!("--start 30 {target} --format csv {more}");
        rows(&succeeds(&track(&dir, &flags)))
    };
    let forwards = tracked("--frames 5");
    assert_eq!(frames(&forwards), [30, 31, 32, 33, 34, 35]);
    let backwards = tracked("--backwards");
    assert_eq!(frames(&backwards), (0..=30).rev().collect::<Vec<u64>>());
    let truth = truth(&dir);
    for row in &backwards {
        assert!(
            error(row, &truth) < 12.0,
            "{row:?} {:?}",
            truth[row.frame as usize]
        );
    }
    let few = tracked("--backwards --frames 0");
    assert_eq!(frames(&few), [30]);
    let line = fails(&["track", text(&dir), &target, "--backwards"]);
    assert!(line.contains("give --start"), "{line}");
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_video_is_tracked_backwards_frame_by_frame_with_an_index_and_without() {
    let parent = folder();
    // More frames than are decoded at once.
    let (dir, target) = long_clip(parent.path(), 79);
    for name in ["indexed.mp4", "plain.avi"] {
        let video = parent.path().join(name);
        video_of(&dir, &video, 1);
        let flags = format!("--start 79 {target} --backwards --format csv");
        let tracked = rows(&succeeds(&track(&video, &flags)));
        assert_eq!(
            frames(&tracked),
            (0..=79).rev().collect::<Vec<u64>>(),
            "{name}"
        );
        // The box of a wrong frame would be off by several pixels.
        let of_folder = rows(&succeeds(&track(&dir, &flags)));
        for (a, b) in tracked.iter().zip(of_folder) {
            let near = (a.area[0] - b.area[0]).hypot(a.area[1] - b.area[1]);
            assert!(near < 3.0, "{name}: {a:?} {b:?}");
        }
        let after = format!("--start 80 {target} --backwards");
        let line = fails(&track(&video, &after));
        assert!(line.contains("--start is after its last frame"), "{line}");
    }
}

#[test]
fn key_frames_give_every_box_to_within_a_pixel_by_straight_lines() {
    let parent = folder();
    let (dir, target) = long_clip(parent.path(), 0);
    let other = "--box=200,30,40,40";
    let flags = ["track", text(&dir), &target, other, "--format", "csv"];
    let all = rows(&succeeds(&flags));
    let keys = rows(&succeeds(&[&flags[..], &["--keyframes"]].concat()));
    assert!(
        keys.len() * 2 < all.len(),
        "{} of {}",
        keys.len(),
        all.len()
    );
    assert!(keys.is_sorted_by_key(|row| (row.frame, row.target)));
    for target in 0..2 {
        let of = |rows: &[Row]| -> Vec<Row> {
            rows.iter()
                .filter(|row| row.target == target)
                .cloned()
                .collect()
        };
        let (all, keys) = (of(&all), of(&keys));
        assert_eq!((keys[0].frame, keys[keys.len() - 1].frame), (0, 79));
        for pair in keys.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            for row in &all[a.frame as usize..b.frame as usize] {
                let part = (row.frame - a.frame) as f64 / (b.frame - a.frame) as f64;
                let between = |side: usize| a.area[side] + part * (b.area[side] - a.area[side]);
                for side in 0..2 {
                    let near = (between(side) - row.area[side]).abs();
                    let far =
                        between(side) + between(side + 2) - row.area[side] - row.area[side + 2];
                    // Rows are rounded to thousandths.
                    assert!(
                        near.max(far.abs()) < 1.01,
                        "{row:?} between {a:?} and {b:?}"
                    );
                }
            }
        }
    }
    let line = fails(&track(&dir, &format!("{target} --keyframes --format otb")));
    assert!(line.contains("--keyframes"), "{line}");
}

#[test]
fn it_ends_with_the_frame_in_which_the_target_is_lost() {
    let parent = folder();
    let (dir, target) = long_clip(parent.path(), 0);
    // From frame 20 on, the frames show an empty scene.
    let empty = image::GrayImage::from_pixel(320, 240, image::Luma([128]));
    for index in 21..=80 {
        let path = dir.join(format!("img/{index:04}.jpg"));
        empty.save(&path).expect("it can be written");
    }
    let flags = ["track", text(&dir), &target, "--format", "csv"];
    let all = rows(&succeeds(&flags));
    let lost = all.iter().position(|row| row.status == "lost");
    let lost = lost.expect("an empty scene has no target");
    assert!((20..60).contains(&lost), "{lost}");
    let until = rows(&succeeds(&[&flags[..], &["--until-lost"]].concat()));
    assert_eq!(until, all[..=lost]);
}
