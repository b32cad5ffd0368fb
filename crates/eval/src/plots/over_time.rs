//! The centre error over time: for each frame the median over the seeds, and for the first variant a band from the
//! best seed to the worst.

use super::count::count;
use super::evaluated::Evaluated;
use super::style::{self, Drawn, Labels, Plane};
use crate::measures::PRECISION_RADIUS;
use crate::run::SequenceRuns;
use plotters::prelude::*;

/// The largest number of variants that a reader can tell apart in one figure.
const MOST: usize = 3;
/// Annotated frames further apart than this are not joined by a line: the error between them is unknown.
const LONGEST_GAP: f64 = 10.0;
/// The least height of the plane in pixels of error: small errors should look small.
const MIN_HEIGHT: f64 = 40.0;
const SIZE: (u32, u32) = (860, 300);

/// The centre errors of a frame over the seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spread {
    frame: f64,
    least: f64,
    median: f64,
    most: f64,
}

/// The figure of the sequence at `index`.
pub(super) fn figure(evaluated: &[Evaluated], index: usize) -> Drawn {
    let shown = &evaluated[..evaluated.len().min(MOST)];
    let sequence = &shown[0].runs[index];
    let spreads: Vec<Vec<Spread>> = shown.iter().map(|v| spread(&v.runs[index])).collect();
    let medians = spreads.iter().flatten().map(|at| at.median);
    let band = spreads[0].iter().map(|at| at.most);
    let highest = medians.chain(band).fold(MIN_HEIGHT, f64::max);
    let seeds = sequence.seeds.len();
    let title = if seeds == 1 {
        format!("{}: centre error over time, 1 seed", sequence.name)
    } else {
        format!(
            "{}: centre error over time, median of {}{}",
            sequence.name,
            count(seeds, "seed"),
            if shown.len() == 1 {
                " and their range"
            } else {
                " (band: range of the first)"
            }
        )
    };
    let labels = Labels {
        title,
        x: "frame",
        y: "centre error in pixels",
        legend: shown.iter().map(|variant| variant.label.clone()).collect(),
    };
    let last = sequence.frames.saturating_sub(1).max(1);
    let plane = Plane {
        size: SIZE,
        x: last as f64,
        y: highest * 1.05,
        digits: (0, 0),
        marks: (12, 7),
    };
    style::figure(&labels, &plane, |chart| {
        // The error below which a frame counts as precise.
        let limit = [(0.0, PRECISION_RADIUS), (last as f64, PRECISION_RADIUS)];
        chart.draw_series(DashedLineSeries::new(limit, 3, 4, BLACK.mix(0.45).into()))?;
        for (curve, spread) in spreads.iter().enumerate().rev() {
            for part in spread.chunk_by(|a, b| b.frame - a.frame <= LONGEST_GAP) {
                let median = part.iter().map(|at| (at.frame, at.median)).collect();
                if curve > 0 {
                    style::line(chart, curve, median)?;
                    continue;
                }
                let top = part.iter().map(|at| (at.frame, at.most));
                let bottom = part.iter().rev().map(|at| (at.frame, at.least));
                let outline: Vec<(f64, f64)> = top.chain(bottom).collect();
                let fill = style::color(curve).mix(0.2).filled();
                chart.draw_series([Polygon::new(outline, fill)])?;
                style::line(chart, curve, median)?;
            }
        }
        Ok(())
    })
}

fn spread(sequence: &SequenceRuns) -> Vec<Spread> {
    let frames = sequence.seeds[0].scored.iter().enumerate();
    let at = |position: usize| {
        let seeds = sequence.seeds.iter();
        let mut errors: Vec<f64> = seeds.map(|s| s.scored[position].center_error).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    frames
        .map(|(position, frame)| {
            let errors = at(position);
            Spread {
                frame: frame.index as f64,
                least: errors[0],
                median: median(&errors),
                most: errors[errors.len() - 1],
            }
        })
        .collect()
}

/// The median of sorted values; of an even number, the mean of the two in the middle.
fn median(sorted: &[f64]) -> f64 {
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 {
        sorted[half]
    } else {
        (sorted[half - 1] + sorted[half]) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{ScoredFrame, SeedRun};
    use bagtrack_tracker::Status;

    #[test]
    fn the_spread_is_over_the_seeds_frame_by_frame() {
        let run = |errors: [f64; 2]| SeedRun {
            boxes: Vec::new(),
            scored: [(3, errors[0]), (8, errors[1])]
                .map(|(index, center_error)| ScoredFrame {
                    index,
                    center_error,
                    overlap: 0.0,
                    score: 0.0,
                    status: Status::Tracking,
                    evidence: None,
                })
                .to_vec(),
            step_ms: 0.0,
        };
        let runs = SequenceRuns {
            name: String::new(),
            frames: 9,
            annotated: 3,
            seeds: vec![
                run([1.0, 7.0]),
                run([9.0, 1.0]),
                run([2.0, 3.0]),
                run([4.0, 3.0]),
            ],
        };
        let at = |frame, least, median, most| Spread {
            frame,
            least,
            median,
            most,
        };
        assert_eq!(
            spread(&runs),
            [at(3.0, 1.0, 3.0, 9.0), at(8.0, 1.0, 3.0, 7.0)]
        );
        assert_eq!(median(&[1.0, 2.0, 9.0]), 2.0);
    }
}
