//! Real video over HTTP.

use crate::application::{TestApplication, expect};
use bagtrack_cli::read_boxes;
use bagtrack_ingest::Limits;
use bagtrack_tracker::{Estimate, Preset, Rect, Tracker};
use reqwest::StatusCode;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    let root = std::env::var_os("BAGTRACK_SEQUENCES");
    PathBuf::from(root.expect("BAGTRACK_SEQUENCES names the folder of the eight videos"))
}

fn frames(folder: &Path) -> Vec<Vec<u8>> {
    let paths = bagtrack_cli::frames::list(folder).unwrap();
    let files = paths.iter().map(|path| std::fs::read(path).unwrap());
    files.collect()
}

/// The first box, and its text in a query.
fn first_box(folder: &Path) -> (Rect, String) {
    let first = read_boxes(folder).unwrap()[0].expect("a first box");
    let Rect {
        x,
        y,
        width,
        height,
    } = first;
    (first, format!("{x},{y},{width},{height}"))
}

fn assert_same(answer: &Value, estimate: &Estimate) {
    assert_eq!(answer["frame"], estimate.frame);
    let target = estimate.target;
    for (name, value) in [
        ("x", target.x),
        ("y", target.y),
        ("width", target.width),
        ("height", target.height),
    ] {
        let got = answer["box"][name].as_f64().unwrap();
        let at = estimate.frame;
        assert!(
            (got - value).abs() < 0.0051,
            "frame {at}: {name} {got} {value}"
        );
    }
    let score = answer["score"].as_f64().unwrap() as f32;
    assert!((score - estimate.score).abs() < 0.00051);
}

#[tokio::test]
#[ignore = "needs the eight videos: set BAGTRACK_SEQUENCES to their folder"]
async fn coke_over_http_gives_the_librarys_boxes() {
    let folder = root().join("Coke");
    let frames = frames(&folder);
    assert!(frames.len() > 100);
    let (target, text) = first_box(&folder);
    let limits = Limits::default();
    let mut params = Preset::Paper.params();
    params.seed = 7;
    let first = bagtrack_ingest::decode(&frames[0], &limits).unwrap();
    let mut tracker = Tracker::new(&first, target, params).unwrap();

    let app = TestApplication::start().await;
    let query = [("box", text.as_str()), ("preset", "paper"), ("seed", "7")];
    let created = expect(
        app.create(frames[0].clone(), &query).await,
        StatusCode::CREATED,
    )
    .await;
    let id = created["id"].as_str().unwrap();
    for frame in &frames[1..] {
        let decoded = bagtrack_ingest::decode(frame, &limits).unwrap();
        let estimate = tracker.step(&decoded).unwrap();
        let answer = expect(app.post_frame(id, frame.clone()).await, StatusCode::OK).await;
        assert_same(&answer, &estimate);
    }
    assert_eq!(app.frames_of(id).await, frames.len() as u64);
}

#[tokio::test]
#[ignore = "needs the eight videos: set BAGTRACK_SEQUENCES to their folder"]
async fn a_session_of_real_video_is_stored_in_48_kib() {
    let app = TestApplication::start().await;
    for entry in std::fs::read_dir(root()).unwrap() {
        let folder = entry.unwrap().path();
        if !folder.is_dir() {
            continue;
        }
        let (_, text) = first_box(&folder);
        let frames = frames(&folder);
        let created = app
            .create(frames[0].clone(), &[("box", text.as_str())])
            .await;
        let created = expect(created, StatusCode::CREATED).await;
        let id = created["id"].as_str().unwrap();
        // After 60 frames the bag is full.
        let mut most = 0;
        for (number, frame) in frames.iter().enumerate().take(240).skip(1) {
            expect(app.post_frame(id, frame.clone()).await, StatusCode::OK).await;
            if number.is_multiple_of(60) {
                most = most.max(app.snapshot(id).await.len());
            }
        }
        println!("{}: at most {most} bytes", folder.display());
        assert!(most <= 48 << 10, "{}: {most} bytes", folder.display());
    }
}
