//! A table for people: 0-based pixels, the score and the status.

use super::row::{Columns, Row};

/// The names of the columns.
pub fn header(columns: Columns) -> String {
    let (time, target) = optional(columns, "time", "target");
    format!(
        "{:>6}{time}{target}{:>9}{:>9}{:>9}{:>9}{:>7}  status",
        "frame", "x", "y", "width", "height", "score"
    )
}

/// The line of a target in a frame.
pub fn line(row: &Row, columns: Columns) -> String {
    let seconds = format!("{:.3}", row.time.unwrap_or_default());
    let (time, target) = optional(columns, &seconds, &row.target.to_string());
    let (area, score) = (row.estimate.target, row.estimate.score);
    format!(
        "{:>6}{time}{target}{:>9.1}{:>9.1}{:>9.1}{:>9.1}{score:>7.2}  {}",
        row.frame,
        area.x,
        area.y,
        area.width,
        area.height,
        row.status()
    )
}

/// The columns that not every table has.
fn optional(columns: Columns, time: &str, target: &str) -> (String, String) {
    let shown = |is_there: bool, text: &str, width: usize| match is_there {
        true => format!("{text:>width$}"),
        false => String::new(),
    };
    (
        shown(columns.time, time, 10),
        shown(columns.target, target, 8),
    )
}
