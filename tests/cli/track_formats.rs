//! How `bagtrack track` writes boxes: formats, several targets, files.

use crate::command::{
    Row, bagtrack, boxes, clip, fails, folder, rows, sample_clip, succeeds, text, track,
};
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
    let (_parent, dir) = sample_clip();
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

/// A table must not be written into a file of another type.
#[test]
fn the_name_of_the_file_says_its_format() {
    let (parent, dir) = sample_clip();
    for (name, format) in [
        ("boxes.csv", "csv"),
        ("boxes.jsonl", "json"),
        ("boxes.xml", "cvat"),
        ("boxes.txt", "text"),
    ] {
        let file = parent.path().join(name);
        let flags = ["track", text(&dir), ONE, "--count", "4"];
        assert_eq!(succeeds(&[&flags[..], &["-o", text(&file)]].concat()), "");
        let written = fs::read_to_string(&file).expect("it was written");
        let expected = succeeds(&[&flags[..], &["--format", format]].concat());
        assert_eq!(written, expected, "{name}");
    }
    let file = parent.path().join("boxes.json");
    let line = fails(&["track", text(&dir), ONE, "-o", text(&file)]);
    assert!(
        line.contains("--format json, coco or label-studio"),
        "{line}"
    );
    assert!(!file.exists());
}

#[test]
fn otb_and_mot_count_from_one() {
    let (_parent, dir) = sample_clip();
    let flags = ["track", text(&dir), ONE, "--start", "2", "--format"];
    let csv = rows(&succeeds(&[&flags[..], &["csv"]].concat()));
    let otb = succeeds(&[&flags[..], &["otb"]].concat());
    assert_eq!(boxes(&otb)[0], [45.1, 102.4, 46.1, 57.6]);
    // The reader of OTB files finds the same boxes as the other formats have.
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
    let (_parent, dir) = sample_clip();
    let flags = ["track", text(&dir), "--seed", "5", "--format"];
    let both = rows(&succeeds(&[&flags[..], &["csv", ONE, OTHER]].concat()));
    let order: Vec<(u64, usize)> = both.iter().map(|row| (row.frame, row.target)).collect();
    let expected: Vec<(u64, usize)> = (0..12).flat_map(|frame| [(frame, 0), (frame, 1)]).collect();
    assert_eq!(order, expected);
    // Alone, the first target has nearly the same boxes: frames are decoded at a size for the smallest target.
    let alone = rows(&succeeds(&[&flags[..], &["csv", ONE]].concat()));
    for (a, b) in areas(&both, 0).iter().zip(areas(&alone, 0)) {
        assert!(
            (a[0] - b[0]).abs() < 2.0 && (a[1] - b[1]).abs() < 2.0,
            "{a:?} {b:?}"
        );
    }
    // The second target stands still, the first one moves.
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
    let (_parent, dir) = sample_clip();
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
    let (parent, dir) = sample_clip();
    let file = parent.path().join("boxes.csv");
    let flags = ["track", text(&dir), "--format", "csv"];
    // A command that fails before the first row leaves no file, which would block the next try.
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
    // An unreadable frame ends the command; the rows before it stay in the file.
    fs::write(dir.join("img/0005.jpg"), "no picture").expect("the folder is writable");
    let file = parent.path().join("part.csv");
    fails(&[&flags[..], &[ONE, "-o", text(&file)]].concat());
    let kept = rows(&fs::read_to_string(&file).expect("it was written"));
    assert_eq!(kept, rows(&printed)[..4]);
}

/// The value of an attribute in a line of XML.
fn attribute<'a>(line: &'a str, name: &str) -> &'a str {
    let (_, rest) = line
        .split_once(&format!(" {name}=\""))
        .expect("it is there");
    rest.split_once('"').expect("it ends").0
}

#[test]
fn documents_of_annotation_tools_tell_the_boxes_of_the_others() {
    let (_parent, dir) = sample_clip();
    let flags = ["track", text(&dir), ONE, OTHER, "--name", "a \"<dog>\""];
    let csv = rows(&succeeds(&[&flags[..4], &["--format", "csv"]].concat()));
    let made = |format| succeeds(&[&flags[..], &["--format", format]].concat());

    let coco: Value = serde_json::from_str(&made("coco")).expect("it is JSON");
    assert_eq!(coco["categories"][0]["name"], "a \"<dog>\"");
    assert_eq!(coco["categories"][1]["name"], "Object 2");
    assert_eq!(coco["images"][3]["file_name"], "0004.jpg");
    assert_eq!(
        (&coco["images"][3]["id"], &coco["images"][3]["frame_id"]),
        (&4.into(), &3.into())
    );
    let notes = coco["annotations"].as_array().expect("a list");
    assert_eq!(notes.len(), csv.len());
    for (note, row) in notes.iter().zip(&csv) {
        assert_eq!(note["image_id"], row.frame + 1);
        assert_eq!(note["track_id"], row.target + 1);
        for (side, value) in row.area.iter().enumerate() {
            let told = note["bbox"][side].as_f64().expect("a number");
            assert!((told - value).abs() < 0.006, "{note} {row:?}");
        }
    }

    let cvat = made("cvat");
    assert!(cvat.contains("<name>a &#34;&#60;dog&#62;&#34;</name>"));
    let boxes: Vec<&str> = cvat.lines().filter(|it| it.starts_with("<box")).collect();
    assert_eq!(boxes.len(), csv.len());
    for row in &csv {
        // The file has the boxes of one track after the other, 12 each.
        let line = boxes[12 * row.target + row.frame as usize];
        assert_eq!(attribute(line, "frame"), row.frame.to_string());
        assert_eq!(attribute(line, "outside"), "0");
        let right: f64 = attribute(line, "xbr").parse().expect("a number");
        assert!((right - row.area[0] - row.area[2]).abs() < 0.006, "{line}");
    }

    let tasks: Value = serde_json::from_str(&made("label-studio")).expect("it is JSON");
    let region = &tasks[0]["annotations"][0]["result"][1]["value"];
    assert_eq!(tasks[0]["data"]["video"], "clip");
    assert_eq!(region["framesCount"], 12);
    let second = csv.iter().filter(|row| row.target == 1);
    for (item, row) in region["sequence"]
        .as_array()
        .expect("a list")
        .iter()
        .zip(second)
    {
        assert_eq!(item["frame"], row.frame + 1);
        let x = item["x"].as_f64().expect("a number") * 3.2;
        assert!((x - row.area[0]).abs() < 0.001, "{item} {row:?}");
    }
}

#[test]
fn a_part_of_a_clip_ends_where_it_was_tracked_to() {
    let (_parent, dir) = sample_clip();
    let flags = ["track", text(&dir), ONE, "--start", "2", "--frames", "5"];
    let cvat = succeeds(&[&flags[..], &["--format", "cvat"]].concat());
    let last = cvat.lines().rfind(|it| it.starts_with("<box"));
    let last = last.expect("there are boxes");
    assert_eq!(
        (attribute(last, "frame"), attribute(last, "outside")),
        ("8", "1")
    );
    let tasks = succeeds(&[&flags[..], &["--format", "label-studio"]].concat());
    let tasks: Value = serde_json::from_str(&tasks).expect("it is JSON");
    let sequence = &tasks[0]["annotations"][0]["result"][0]["value"]["sequence"];
    let enabled: Vec<bool> = (0..6)
        .map(|at| sequence[at]["enabled"].as_bool().expect("it is there"))
        .collect();
    assert_eq!(enabled, [true, true, true, true, true, false]);
    // If tracking reaches the last frame, or goes back from it, no frame follows the row.
    let flags = format!("{ONE} --start 11 --format cvat");
    for (more, first_frame) in [("--frames 99", "11"), ("--backwards", "0")] {
        let cvat = succeeds(&track(&dir, &format!("{flags} {more}")));
        assert!(!cvat.contains("outside=\"1\""), "{cvat}");
        let first = cvat.lines().find(|it| it.starts_with("<box"));
        let frame = attribute(first.expect("there are boxes"), "frame");
        assert_eq!(frame, first_frame);
    }
}

#[test]
fn labels_of_yolo_go_to_a_new_folder() {
    let (parent, dir) = sample_clip();
    let flags = ["track", text(&dir), ONE, OTHER, "--format", "yolo"];
    assert!(fails(&flags).contains("-o DIR"));
    let out = parent.path().join("labels");
    let with = [&flags[..], &["-o", text(&out)]].concat();
    assert_eq!(succeeds(&with), "");
    let about = fs::read_to_string(out.join("data.yaml")).expect("it was written");
    // With an entry `path`, the data set could be found from one folder only.
    assert!(about.starts_with("train: images/train\n"), "{about}");
    assert!(
        about.ends_with("names:\n  0: \"Object 1\"\n  1: \"Object 2\"\n"),
        "{about}"
    );
    let first = fs::read_to_string(out.join("labels/train/0001.txt")).expect("it was written");
    assert_eq!(
        first,
        "0 0.209844 0.542500 0.144063 0.240000\n1 0.687500 0.208333 0.125000 0.166667\n"
    );
    assert!(out.join("labels/train/0012.txt").exists());
    assert!(fails(&with).contains("labels is not empty"));
    for format in ["coco", "yolo", "otb"] {
        let line = fails(&["track", text(&dir), ONE, "--keyframes", "--format", format]);
        assert!(line.contains("boxes of every frame"), "{line}");
    }
    let line = fails(&["track", text(&dir), ONE, "--name", "a", "--name", "b"]);
    assert!(
        line.contains("--name is given 2 times, for 1 box\n"),
        "{line}"
    );
}

/// With control characters in it, no XML parser would accept the file.
#[test]
fn what_xml_does_not_have_is_in_no_name() {
    let parent = folder();
    let dir = clip(parent.path(), "a\u{1}b", &["--frames", "3"]);
    let cvat = succeeds(&["track", text(&dir), ONE, "--format", "cvat"]);
    assert!(cvat.contains("a\u{fffd}b"), "{cvat}");
    assert!(!cvat.contains('\u{1}'), "{cvat}");
    let refused = bagtrack(&["track", text(&dir), ONE, "--name", "a\u{1}b"]);
    let told = String::from_utf8(refused.stderr).expect("it is text");
    assert!(told.contains("no control characters"), "{told}");
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn targets_of_one_name_are_one_class() {
    let (parent, dir) = sample_clip();
    let flags = format!("{ONE} {OTHER} --name a --name a");
    let flags = track(&dir, &flags);
    let out = parent.path().join("labels");
    succeeds(&[&flags[..], &["--format", "yolo", "-o", text(&out)]].concat());
    let about = fs::read_to_string(out.join("data.yaml")).expect("it was written");
    assert!(about.ends_with("names:\n  0: \"a\"\n"), "{about}");
    let first = fs::read_to_string(out.join("labels/train/0001.txt")).expect("it was written");
    assert!(first.lines().all(|line| line.starts_with("0 ")), "{first}");
    let coco = succeeds(&[&flags[..], &["--format", "coco"]].concat());
    let coco: Value = serde_json::from_str(&coco).expect("it is JSON");
    assert_eq!(coco["categories"].as_array().map(Vec::len), Some(1));
    let notes = coco["annotations"].as_array().expect("there are boxes");
    assert!(notes.iter().all(|note| note["category_id"] == 1));
    assert!(notes.iter().any(|note| note["track_id"] == 2));
    let cvat = succeeds(&[&flags[..], &["--format", "cvat"]].concat());
    assert_eq!(cvat.matches("<label>").count(), 1, "{cvat}");
    assert_eq!(cvat.matches("label=\"a\"").count(), 2, "{cvat}");
}
