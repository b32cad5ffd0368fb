//! The clips that clients upload: real videos from the folder `BAGTRACK_SEQUENCES`, or else the sample clip.

use bagtrack_sample::{Clip as Sample, Settings};
use bagtrack_tracker::Rect;
use image::ImageFormat;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The frames of a video as image files, and the box in the first one.
#[derive(Clone)]
pub struct Clip {
    pub frames: Vec<Vec<u8>>,
    pub first_box: String,
}

impl Clip {
    /// The clip of a client, with this number of frames, the first one included.
    pub fn of(client: usize, frames: usize) -> Self {
        match std::env::var_os("BAGTRACK_SEQUENCES") {
            Some(root) => Self::video(&PathBuf::from(root), client, frames),
            None => Self::sample(client, frames),
        }
    }

    /// The clips of this number of clients, each with this number of frames after the first.
    pub fn of_each(clients: usize, frames: usize) -> Vec<Self> {
        (0..clients)
            .map(|client| Self::of(client, frames + 1))
            .collect()
    }

    fn video(root: &Path, client: usize, frames: usize) -> Self {
        let folders = std::fs::read_dir(root).expect("BAGTRACK_SEQUENCES names a folder");
        let mut folders: Vec<PathBuf> = folders
            .map(|entry| entry.expect("a readable folder").path())
            .filter(|path| path.join("groundtruth_rect.txt").is_file())
            .collect();
        folders.sort();
        let folder = &folders[client % folders.len()];
        let paths = bagtrack_cli::frames::list(folder).expect("a folder of frames");
        let boxes = bagtrack_cli::read_boxes(folder).expect("the file is there");
        Self {
            frames: paths
                .iter()
                .take(frames)
                .map(|path| std::fs::read(path).unwrap())
                .collect(),
            first_box: text(boxes[0].expect("a first box")),
        }
    }

    fn sample(client: usize, frames: usize) -> Self {
        let sample = Sample::new(Settings {
            frames: u32::try_from(frames).unwrap().max(200),
            seed: client as u64 % 3,
            ..Settings::default()
        })
        .expect("a clip");
        let encode = |index: u32| {
            let mut bytes = Cursor::new(Vec::new());
            let picture = sample.draw(index);
            picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
            bytes.into_inner()
        };
        Self {
            frames: (0..u32::try_from(frames).unwrap()).map(encode).collect(),
            first_box: text(sample.target(0)),
        }
    }
}

fn text(target: Rect) -> String {
    format!(
        "{},{},{},{}",
        target.x, target.y, target.width, target.height
    )
}
