//! Comma-separated values with a header (RFC 4180): for spreadsheets, pandas and R. Pixels are 0-based.

use super::row::Row;

/// The names of the columns. `time` is empty for frames of a folder.
pub const HEADER: &str = "frame,time,target,x,y,width,height,score,status";

/// The line of a target in a frame.
pub fn line(row: &Row) -> String {
    let time = row.time.map_or(String::new(), |time| format!("{time:.6}"));
    let (area, score) = (row.estimate.target, row.estimate.score);
    format!(
        "{},{time},{},{:.3},{:.3},{:.3},{:.3},{score:.4},{}",
        row.frame,
        row.target,
        area.x,
        area.y,
        area.width,
        area.height,
        row.status()
    )
}
