//! A JSON object a line: a box as the service answers it, with the frame and the target that it is of.

use super::row::Row;
use bagtrack_tracker::{Rect, Status};

#[derive(serde::Serialize)]
struct Object<'a> {
    frame: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
    target: usize,
    #[serde(rename = "box")]
    area: Rect,
    score: f32,
    status: Status,
}

/// The line of a target in a frame.
pub fn line(row: &Row) -> serde_json::Result<String> {
    serde_json::to_string(&Object {
        frame: row.frame,
        time: row.time,
        file: row.file.as_deref(),
        target: row.target,
        area: row.estimate.target,
        score: row.estimate.score,
        status: row.estimate.status,
    })
}
