//! The folder of a dataset for Ultralytics' YOLO: `data.yaml`, and for each frame a text in `labels/train` with the
//! class, the centre and the size of each box, as shares of the frame. Lost targets are left out. The pictures go to
//! `images/train`, with the names of the texts.

use super::TextFile;
use super::clip::{Clip, image_name};
use super::row::Row;
use std::path::Path;

/// Without `path` the folders are beside `data.yaml`, wherever it lies. Ultralytics does not train without `val`; if
/// `val` named the same frames, readers of annotations would get each box twice.
const BEGINNING: &str =
    "train: images/train\n# To train, add other frames to validate with: val: images/val\nnames:\n";

/// The texts of rows in the order of frames.
pub fn folder(clip: &Clip, rows: &[Row]) -> serde_json::Result<Vec<TextFile>> {
    let mut about = BEGINNING.to_owned();
    let classes = clip.classes();
    for (class, name) in classes.iter().enumerate() {
        // A JSON string is a YAML string.
        about += &format!("  {class}: {}\n", serde_json::to_string(name)?);
    }
    let of_frames = rows.chunk_by(|one, other| one.frame == other.frame);
    let labels = of_frames.map(|of_frame| {
        let picture = image_name(&of_frame[0]);
        let name = Path::new(&picture).with_extension("txt");
        TextFile {
            path: format!("labels/train/{}", name.display()),
            text: of_frame
                .iter()
                .filter_map(|row| line(clip, &classes, row))
                .collect(),
        }
    });
    let about = TextFile {
        path: "data.yaml".to_owned(),
        text: about,
    };
    Ok(std::iter::once(about).chain(labels).collect())
}

/// The line of a target, whose class is its name.
fn line(clip: &Clip, classes: &[&str], row: &Row) -> Option<String> {
    let area = clip.inside(row)?;
    let class = classes
        .iter()
        .position(|class| *class == clip.names[row.target])?;
    let (width, height) = (f64::from(clip.size.0), f64::from(clip.size.1));
    let x = (area.x + area.width / 2.0) / width;
    let y = (area.y + area.height / 2.0) / height;
    let (width, height) = (area.width / width, area.height / height);
    Some(format!("{class} {x:.6} {y:.6} {width:.6} {height:.6}\n"))
}
