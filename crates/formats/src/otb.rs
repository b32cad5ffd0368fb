//! The result file of the Object Tracking Benchmark: `x,y,width,height` a frame, in 1-based pixels.

use super::row::Row;

/// The line of a frame. It does not say which target or frame it is of.
pub fn line(row: &Row) -> String {
    let area = row.estimate.target;
    let (x, y) = (area.x + 1.0, area.y + 1.0);
    format!("{x:.3},{y:.3},{:.3},{:.3}", area.width, area.height)
}
