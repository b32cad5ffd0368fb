//! What documents say of the video beside its boxes.

use super::row::Row;
use bagtrack_tracker::{Rect, Status};

/// The video or folder that rows are of.
#[derive(Debug)]
pub struct Clip {
    /// The name of its file or folder.
    pub name: String,
    /// Width and height of its frames in pixels.
    pub size: (u32, u32),
    /// Frames a second.
    pub rate: f64,
    /// What each target is called.
    pub names: Vec<String>,
    /// Whether it has a frame after the last row.
    pub goes_on: bool,
}

impl Clip {
    /// The part of a box that is in the frame; none where there is no such part, or where the target is lost.
    pub fn inside(&self, row: &Row) -> Option<Rect> {
        let area = row.estimate.target;
        let (x, y) = (area.x.max(0.0), area.y.max(0.0));
        let right = (area.x + area.width).min(f64::from(self.size.0));
        let bottom = (area.y + area.height).min(f64::from(self.size.1));
        let is_seen = row.estimate.status != Status::Lost && right > x && bottom > y;
        is_seen.then_some(Rect::new(x, y, right - x, bottom - y))
    }

    /// The classes of the targets, in the order of the targets; targets of one name share a class.
    pub fn classes(&self) -> Vec<&str> {
        let mut classes: Vec<&str> = Vec::new();
        for name in &self.names {
            if !classes.contains(&name.as_str()) {
                classes.push(name);
            }
        }
        classes
    }

    /// How many frames the rows reach over, from the first of the video.
    pub fn length(rows: &[Row]) -> u64 {
        rows.iter().map(|row| row.frame + 1).max().unwrap_or(0)
    }
}

/// The name of the picture of a frame: its file's, or one that is made of its number.
pub fn image_name(row: &Row) -> String {
    let made = || format!("frame_{:06}.jpg", row.frame);
    row.file.clone().unwrap_or_else(made)
}
