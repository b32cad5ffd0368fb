//! How `bagtrack track` writes boxes: formats, several targets, files.

use crate::command::{Row, boxes, clip, fails, folder, rows, succeeds, text};
use bagtrack_cli::parse_boxes;
use serde_json::Value;
use std::fs;

const ONE: &str = "--box=44.1,101.4,46.1,57.6";
const OTHER: &str = "--box=200,30,40,40";

fn areas(rows: &[Row], target: usize) -> Vec<[f64; 4]> {
    let of_target = rows.iter().filter(|row| row.target == target);
    of_target.map(|row| row.area).collect()
}

#[test]
fn the_default_is_a_table_with_score_and_status() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let table = succeeds(&["track", text(&dir), ONE]);
    let lines: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(
        lines[0],
        ["frame", "x", "y", "width", "height", "score", "status"]
    );
    assert_eq!(
        lines[1],
        ["0", "44.1", "101.4", "46.1", "57.6", "1.00", "tracking"]
    );
    assert_eq!(lines.len(), 13);
    let table = succeeds(&["track", text(&dir), ONE, OTHER]);
    let lines: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(lines[0][..3], ["frame", "target", "x"]);
    assert_eq!(
        lines[2],
        [
            "0", "1", "200.0", "30.0", "40.0", "40.0", "1.00", "tracking"
        ]
    );
    assert_eq!(lines.len(), 25);
}

#[test]
fn otb_and_mot_count_from_one() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let flags = ["track", text(&dir), ONE, "--start", "2", "--format"];
    let csv = rows(&succeeds(&[&flags[..], &["csv"]].concat()));
    let otb = succeeds(&[&flags[..], &["otb"]].concat());
    assert_eq!(boxes(&otb)[0], [45.1, 102.4, 46.1, 57.6]);
    // The reader of the benchmark's files finds the boxes of the other formats.
    let read = parse_boxes(&otb).expect("it is the benchmark's format");
    assert_eq!(read.len(), csv.len());
    for (read, row) in read.iter().zip(&csv) {
        let read = read.expect("there is a box");
        let read = [read.x, read.y, read.width, read.height];
        let near = read.iter().zip(row.area).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near, "{read:?} {row:?}");
    }
    let mot = succeeds(&[&flags[..], &["mot", OTHER]].concat());
    let lines: Vec<&str> = mot.lines().collect();
    assert_eq!(lines.len(), 20);
    assert_eq!(lines[0], "3,1,45.100,102.400,46.100,57.600,1.0000,-1,-1,-1");
    assert_eq!(lines[1], "3,2,201.000,31.000,40.000,40.000,1.0000,-1,-1,-1");
    assert!(lines[19].starts_with("12,2,"), "{mot}");
}

#[test]
fn several_targets_are_followed_as_each_would_be_in_a_session() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let flags = ["track", text(&dir), "--seed", "5", "--format"];
    let both = rows(&succeeds(&[&flags[..], &["csv", ONE, OTHER]].concat()));
    let order: Vec<(u64, usize)> = both.iter().map(|row| (row.frame, row.target)).collect();
    let expected: Vec<(u64, usize)> = (0..12).flat_map(|frame| [(frame, 0), (frame, 1)]).collect();
    assert_eq!(order, expected);
    // The first target is the one that it is alone. The frames are decoded for the smallest, so only nearly.
    let alone = rows(&succeeds(&[&flags[..], &["csv", ONE]].concat()));
    for (a, b) in areas(&both, 0).iter().zip(areas(&alone, 0)) {
        assert!(
            (a[0] - b[0]).abs() < 2.0 && (a[1] - b[1]).abs() < 2.0,
            "{a:?} {b:?}"
        );
    }
    // The second stands still, the first one does not.
    let last = |target| areas(&both, target)[11];
    assert!((last(1)[0] - 200.0).abs() < 5.0 && (last(1)[1] - 30.0).abs() < 5.0);
    assert!((last(0)[1] - 101.4).abs() > 10.0, "{:?}", last(0));
    let json = succeeds(&[&flags[..], &["json", ONE, OTHER]].concat());
    for (line, row) in json.lines().zip(&both) {
        let value: Value = serde_json::from_str(line).expect("each line is JSON");
        assert_eq!(
            (&value["frame"], &value["target"]),
            (&row.frame.into(), &row.target.into())
        );
        let x = value["box"]["x"].as_f64().expect("a number");
        assert!((x - row.area[0]).abs() < 1e-3);
        assert_eq!(value["status"], row.status);
    }
}

#[test]
fn too_many_targets_and_a_format_without_them_are_refused() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let sixteen = [ONE; 16];
    let flags = ["track", text(&dir), "--format", "csv", "--start", "11"];
    let found = rows(&succeeds(&[&flags[..], &sixteen].concat()));
    assert_eq!(found.last().map(|row| row.target), Some(15));
    let line = fails(&[&flags[..], &sixteen, &[ONE]].concat());
    assert!(
        line.contains("--box is given 17 times; 16 targets"),
        "{line}"
    );
    let line = fails(&["track", text(&dir), ONE, OTHER, "--format", "otb"]);
    assert!(
        line.contains("one target a file") && line.contains("mot"),
        "{line}"
    );
    let line = fails(&["track", text(&dir), ONE, "--box=900,1,20,20"]);
    assert!(
        line.contains("0001.jpg: target 1: the box is outside"),
        "{line}"
    );
}

#[test]
fn boxes_go_to_a_new_file() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &[]);
    let file = parent.path().join("boxes.csv");
    let flags = ["track", text(&dir), "--format", "csv"];
    // What fails before the first row leaves no file that would be in the way.
    fails(&[&flags[..], &["--box=900,1,20,20", "-o", text(&file)]].concat());
    assert!(!file.exists());
    let printed = succeeds(&[&flags[..], &[ONE]].concat());
    let nothing = succeeds(&[&flags[..], &[ONE, "-o", text(&file)]].concat());
    assert_eq!(nothing, "");
    assert_eq!(fs::read_to_string(&file).expect("it was written"), printed);
    let line = fails(&[&flags[..], &["-o", text(&file)]].concat());
    assert!(line.contains("boxes.csv: it is there"), "{line}");
    assert_eq!(fs::read_to_string(&file).expect("it is there"), printed);
    let nowhere = parent.path().join("nowhere/boxes.csv");
    let line = fails(&[&flags[..], &["-o", text(&nowhere)]].concat());
    assert!(line.contains("nowhere"), "{line}");
    assert_eq!(succeeds(&[&flags[..], &[ONE, "-o", "-"]].concat()), printed);
    // A frame that cannot be read ends the command; what was written before stays.
    fs::write(dir.join("img/0005.jpg"), "no picture").expect("the folder is writable");
    let file = parent.path().join("part.csv");
    fails(&[&flags[..], &[ONE, "-o", text(&file)]].concat());
    let kept = rows(&fs::read_to_string(&file).expect("it was written"));
    assert_eq!(kept, rows(&printed)[..4]);
}
