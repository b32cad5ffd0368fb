//! COCO's JSON for object detection, with `videos`, `video_id`, `frame_id` and `track_id` as in formats for video that
//! derive from it. Images and categories count from 1, frames from 0. Lost targets are left out.

use super::clip::{Clip, image_name};
use super::row::Row;
use serde::Serialize;

#[derive(Serialize)]
struct Document<'a> {
    info: Info,
    licenses: [(); 0],
    videos: [Video; 1],
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: Vec<Category<'a>>,
}

#[derive(Serialize)]
struct Info {
    description: String,
}

#[derive(Serialize)]
struct Video {
    id: u32,
    name: String,
}

#[derive(Serialize)]
struct Image {
    id: u64,
    file_name: String,
    width: u32,
    height: u32,
    video_id: u32,
    frame_id: u64,
}

#[derive(Serialize)]
struct Annotation {
    id: usize,
    image_id: u64,
    category_id: usize,
    track_id: usize,
    video_id: u32,
    bbox: [f64; 4],
    area: f64,
    iscrowd: u8,
    segmentation: [(); 0],
    score: f32,
}

#[derive(Serialize)]
struct Category<'a> {
    id: usize,
    name: &'a str,
    supercategory: &'static str,
}

/// The only video of a document.
const VIDEO: u32 = 1;

/// The document of rows in the order of frames.
pub fn document(clip: &Clip, rows: &[Row]) -> serde_json::Result<String> {
    let classes = clip.classes();
    let class_of = |target: usize| {
        classes
            .iter()
            .position(|class| *class == clip.names[target])
    };
    let seen = rows.iter().filter_map(|row| {
        let area = clip.inside(row)?;
        Some((row, area, class_of(row.target)?))
    });
    let annotations = seen.enumerate().map(|(at, (row, area, class))| {
        let bbox = [area.x, area.y, area.width, area.height].map(hundredths);
        Annotation {
            id: at + 1,
            image_id: row.frame + 1,
            category_id: class + 1,
            track_id: row.target + 1,
            video_id: VIDEO,
            bbox,
            area: bbox[2] * bbox[3],
            iscrowd: 0,
            segmentation: [],
            score: row.estimate.score,
        }
    });
    let categories = classes.iter().enumerate().map(|(class, name)| Category {
        id: class + 1,
        name,
        supercategory: "",
    });
    super::pretty(&Document {
        info: Info {
            description: format!("bagtrack: {}", clip.name),
        },
        licenses: [],
        videos: [Video {
            id: VIDEO,
            name: clip.name.clone(),
        }],
        images: images(clip, rows),
        annotations: annotations.collect(),
        categories: categories.collect(),
    })
}

/// An image for each frame that was tracked.
fn images(clip: &Clip, rows: &[Row]) -> Vec<Image> {
    let of_frames = rows.chunk_by(|one, other| one.frame == other.frame);
    let (width, height) = clip.size;
    let images = of_frames.map(|of_frame| Image {
        id: of_frame[0].frame + 1,
        file_name: image_name(&of_frame[0]),
        width,
        height,
        video_id: VIDEO,
        frame_id: of_frame[0].frame,
    });
    images.collect()
}

fn hundredths(pixels: f64) -> f64 {
    (100.0 * pixels).round() / 100.0
}
