//! The precision plot and the success plot: shares of frames by a threshold, means over seeds and sequences.

use super::count::count;
use super::evaluated::Evaluated;
use super::style::{self, Drawn, Labels, Plane};
use crate::measures::{self, PRECISION_RADIUS, mean};
use crate::run::{ScoredFrame, SequenceRuns};

/// The largest radius of the precision plot, in pixels.
const LARGEST_RADIUS: u32 = 50;
/// Steps of the success plot from 0 to 1: those of the area under it.
const SUCCESS_STEPS: u32 = 20;

const SIZE: (u32, u32) = (640, 400);

pub(super) fn precision(evaluated: &[Evaluated]) -> Drawn {
    let at = |runs: &[SequenceRuns], radius: f64| {
        over_runs(
            runs,
            |frame| frame.center_error,
            |errors| measures::precision(errors, radius),
        )
    };
    let labels = Labels {
        title: title("Precision", evaluated),
        x: "centre error of at most, in pixels",
        y: "share of frames",
        legend: legend(evaluated, "at 20 px", |runs| at(runs, PRECISION_RADIUS)),
    };
    let plane = Plane {
        size: SIZE,
        x: f64::from(LARGEST_RADIUS),
        y: 1.0,
        digits: (0, 1),
        marks: (11, 11),
    };
    let curve = |runs: &[SequenceRuns]| {
        let radii = (0..=LARGEST_RADIUS).map(f64::from);
        radii.map(|radius| (radius, at(runs, radius))).collect()
    };
    draw(evaluated, &labels, &plane, curve)
}

pub(super) fn success(evaluated: &[Evaluated]) -> Drawn {
    let at = |runs: &[SequenceRuns], threshold: f64| {
        over_runs(
            runs,
            |frame| frame.overlap,
            |overlaps| measures::success(overlaps, threshold),
        )
    };
    let area =
        |runs: &[SequenceRuns]| over_runs(runs, |frame| frame.overlap, measures::success_auc);
    let labels = Labels {
        title: title("Success", evaluated),
        x: "overlap of more than",
        y: "share of frames",
        legend: legend(evaluated, "area under the curve", area),
    };
    let plane = Plane {
        size: SIZE,
        x: 1.0,
        y: 1.0,
        digits: (1, 1),
        marks: (11, 11),
    };
    let curve = |runs: &[SequenceRuns]| {
        let thresholds = (0..=SUCCESS_STEPS).map(|step| f64::from(step) / f64::from(SUCCESS_STEPS));
        thresholds.map(|t| (t, at(runs, t))).collect()
    };
    draw(evaluated, &labels, &plane, curve)
}

fn draw(
    evaluated: &[Evaluated],
    labels: &Labels,
    plane: &Plane,
    curve: impl Fn(&[SequenceRuns]) -> Vec<(f64, f64)>,
) -> Drawn {
    style::figure(labels, plane, |chart| {
        // The first variant is the reference, so it is drawn last, on top.
        for (index, variant) in evaluated.iter().enumerate().rev() {
            style::line(chart, index, curve(&variant.runs))?;
        }
        Ok(())
    })
}

/// The mean over the sequences of the means over the seeds of `measure` of the frames' values.
fn over_runs(
    runs: &[SequenceRuns],
    value: impl Fn(&ScoredFrame) -> f64,
    measure: impl Fn(&[f64]) -> f64,
) -> f64 {
    let of_sequence = |sequence: &SequenceRuns| {
        let seeds = sequence.seeds.iter().map(|seed| {
            let values: Vec<f64> = seed.scored.iter().map(&value).collect();
            measure(&values)
        });
        mean(&seeds.collect::<Vec<f64>>())
    };
    mean(&runs.iter().map(of_sequence).collect::<Vec<f64>>())
}

fn legend(
    evaluated: &[Evaluated],
    of: &str,
    figure: impl Fn(&[SequenceRuns]) -> f64,
) -> Vec<String> {
    evaluated
        .iter()
        .map(|variant| format!("{} ({:.3} {of})", variant.label, figure(&variant.runs)))
        .collect()
}

fn title(what: &str, evaluated: &[Evaluated]) -> String {
    let runs = evaluated.first().map_or(&[][..], |first| &first.runs);
    let seeds = runs.first().map_or(0, |sequence| sequence.seeds.len());
    format!(
        "{what}: {}, {}",
        count(runs.len(), "sequence"),
        count(seeds, "seed")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::SeedRun;
    use bagtrack_tracker::Status;

    fn run(errors: &[f64]) -> SeedRun {
        let frame = |(index, &center_error): (usize, &f64)| ScoredFrame {
            index: index + 1,
            center_error,
            overlap: 0.0,
            score: 0.0,
            status: Status::Tracking,
            evidence: None,
        };
        SeedRun {
            boxes: Vec::new(),
            scored: errors.iter().enumerate().map(frame).collect(),
            step_ms: 0.0,
        }
    }

    #[test]
    fn every_sequence_has_the_same_weight() {
        let sequence = |seeds: Vec<SeedRun>| SequenceRuns {
            name: String::new(),
            frames: 0,
            annotated: 0,
            seeds,
        };
        // 1/2 and 1 on the first, 0 on the second.
        let runs = [
            sequence(vec![run(&[1.0, 9.0]), run(&[1.0, 5.0])]),
            sequence(vec![run(&[9.0, 9.0, 9.0, 9.0]), run(&[9.0])]),
        ];
        let share = over_runs(
            &runs,
            |frame| frame.center_error,
            |errors| measures::precision(errors, 5.0),
        );
        assert_eq!(share, 0.375);
    }
}
