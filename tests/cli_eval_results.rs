//! `bagtrack eval --results`: the boxes as other toolkits read them.

mod command;

use bagtrack::eval::parse_boxes;
use command::{bagtrack, clip, fails, folder, succeeds, text};
use std::fs;

#[test]
fn each_sequence_and_seed_has_a_file_of_the_boxes_that_track_gives() {
    let parent = folder();
    let one = clip(parent.path(), "one", &["--seed", "1"]);
    let two = clip(parent.path(), "two", &["--seed", "2", "--frames", "6"]);
    let results = parent.path().join("results");
    let args = ["eval", text(&one), text(&two), "--results", text(&results)];
    succeeds(&[&args[..], &["--seeds", "2"]].concat());
    for (dir, seed) in [(&one, "0"), (&one, "1"), (&two, "0"), (&two, "1")] {
        let name = dir.file_name().expect("a folder's name").to_string_lossy();
        let file = results.join(format!("seed-{seed}/{name}.txt"));
        let written = fs::read_to_string(file).expect("the file is there");
        let written = parse_boxes(&written).expect("it has the layout of the benchmark");
        let tracked = succeeds(&["track", text(dir), "--seed", seed]);
        let numbers = |line: &str| -> Vec<f64> {
            let fields = line.split(',');
            fields.map(|it| it.parse().expect("a number")).collect()
        };
        assert_eq!(written.len(), tracked.lines().count());
        for (written, tracked) in written.iter().zip(tracked.lines()) {
            let written = written.expect("every frame has a box");
            let written = [written.x, written.y, written.width, written.height];
            for (written, tracked) in written.iter().zip(numbers(tracked)) {
                assert!((written - tracked).abs() < 1e-3, "{written} {tracked}");
            }
        }
    }
    // One seed needs no folder of its own, and older files make way.
    succeeds(&args);
    let first = fs::read_to_string(results.join("one.txt")).expect("the file is there");
    assert_eq!(
        first,
        fs::read_to_string(results.join("seed-0/one.txt")).expect("it is there")
    );
}

#[test]
fn results_that_would_mislead_are_refused() {
    let parent = folder();
    let one = clip(parent.path(), "clip", &[]);
    let other = parent.path().join("other");
    fs::create_dir(&other).expect("the folder is writable");
    let same = clip(&other, "clip", &["--seed", "3"]);
    let results = parent.path().join("results");
    let message = fails(&["eval", text(&one), text(&same), "--results", text(&results)]);
    assert!(
        message.contains("two sequences are called clip"),
        "{message}"
    );
    for flag in [&["--backwards"][..], &["--ablate"], &["--start-at", "0.5"]] {
        let args = [&["eval", text(&one), "--results", text(&results)], flag].concat();
        assert_eq!(bagtrack(&args).status.code(), Some(2), "{flag:?}");
    }
}
