//! Real video over HTTP.

use crate::application::{TestApplication, expect};
use bagtrack_cli::read_boxes;
use reqwest::StatusCode;
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

/// The first box of a sequence, as text for a query.
fn first_box(folder: &Path) -> String {
    let first = read_boxes(folder).unwrap()[0].expect("a first box");
    format!("{},{},{},{}", first.x, first.y, first.width, first.height)
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
        let text = first_box(&folder);
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
