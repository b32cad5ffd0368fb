//! The result file of the MOTChallenge: `frame,id,left,top,width,height,confidence,-1,-1,-1`. Frames, targets and
//! pixels count from 1; the last three are a place in the world, which is not known.

use super::row::Row;

/// The line of a target in a frame.
pub fn line(row: &Row) -> String {
    let (area, score) = (row.estimate.target, row.estimate.score);
    let (left, top) = (area.x + 1.0, area.y + 1.0);
    format!(
        "{},{},{left:.3},{top:.3},{:.3},{:.3},{score:.4},-1,-1,-1",
        row.frame + 1,
        row.target + 1,
        area.width,
        area.height
    )
}
