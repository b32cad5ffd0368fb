//! The score's fit set beside the tracker's own coefficients.

use super::calibration;
use super::outcome::{HIT_OVERLAP, Outcome};
use super::playback::Playback;
use super::run::{ScoredFrame, SequenceRuns};
use super::score_fit::{self, Sample};
use bagtrack_tracker::{PREDICTORS, Preset, ScoreModel, Status};
use serde::Serialize;

/// The score cannot be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ScoreFitError {
    /// The score is not a logistic function with these parameters.
    #[error("there is no score to fit without a discriminant: discriminant_weight must be above 0")]
    NoDiscriminant,
    /// There are only hits or only misses, so a fit cannot separate them.
    #[error(
        "there is nothing to fit: the scored frames must be hits (overlap >= 0.5) and misses, not one kind alone"
    )]
    OneKind,
}

/// A scored frame whose score can be fitted.
#[derive(Debug, Clone, Copy)]
struct LabelledFrame {
    sample: Sample,
    lost: bool,
}

impl LabelledFrame {
    fn of(frame: &ScoredFrame) -> Option<Self> {
        let predictors = frame.evidence?.predictors()?;
        let hit = frame.overlap >= HIT_OVERLAP;
        Some(Self {
            sample: Sample { predictors, hit },
            lost: frame.status == Status::Lost,
        })
    }
}

/// How good a score is over some frames; see [`calibration`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Quality {
    pub(super) roc_auc: Option<f64>,
    pub(super) ece: Option<f64>,
}

impl Quality {
    fn of(judged: &[Outcome]) -> Self {
        Self {
            roc_auc: calibration::roc_auc(judged),
            ece: calibration::calibration_error(judged),
        }
    }
}

/// A model and how good its score is over all frames of all sequences.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Row {
    #[serde(flatten)]
    pub(super) model: ScoreModel,
    #[serde(flatten)]
    pub(super) quality: Quality,
}

/// A sequence, and the model fitted to all others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LeftOut {
    pub(super) name: String,
    /// Scored frames of all seeds, and those of them that are hits.
    pub(super) frames: usize,
    pub(super) hits: usize,
    /// Of the tracker's model over this sequence.
    pub(super) tracker: Quality,
    /// Of the model fitted to the others, over this sequence; None where there is none.
    pub(super) fitted: Option<Row>,
}

/// The score's fit: the coefficients of the tracker and of a [fit](super::fit_score) to all sequences, and those of
/// fits that leave one sequence out, each with the area under the ROC curve and the calibration error of its score.
///
/// The fit is made of frames in which the target is not lost: the score of others is no more than 0.1 by rule. The
/// figures are of all scored frames. As text (`Display`) a table, as JSON (`Serialize`) the same in full precision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreReport {
    pub(super) preset: Preset,
    /// None where it is the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) playback: Option<Playback>,
    pub(super) seeds: usize,
    pub(super) predictors: [&'static str; PREDICTORS.len()],
    pub(super) frames: usize,
    pub(super) hits: usize,
    pub(super) lost: usize,
    pub(super) tracker: Row,
    pub(super) fitted: Row,
    /// Over all sequences, each scored by the model that is fitted to the others; None where one of these is missing.
    pub(super) leaving_one_out: Option<Quality>,
    pub(super) sequences: Vec<LeftOut>,
}

impl ScoreReport {
    /// Fits the score to the runs of one or more sequences with `preset`.
    ///
    /// # Errors
    /// [`ScoreFitError`].
    pub fn new(preset: Preset, runs: &[SequenceRuns]) -> Result<Self, ScoreFitError> {
        let outcomes: Vec<Vec<LabelledFrame>> = runs.iter().map(outcomes).collect();
        let pooled = outcomes.concat();
        if pooled.is_empty() {
            return Err(ScoreFitError::NoDiscriminant);
        }
        let samples: Vec<Vec<Sample>> = outcomes.iter().map(|of| samples(of)).collect();
        let row = |model: ScoreModel, outcomes: &[LabelledFrame]| Row {
            model,
            quality: Quality::of(&judged(outcomes, &model)),
        };
        let fitted = score_fit::fit(&samples).ok_or(ScoreFitError::OneKind)?;
        let mut left_out = Vec::new();
        let mut unseen = Vec::new();
        for (index, outcomes) in outcomes.iter().enumerate() {
            let mut others = samples.clone();
            others.remove(index);
            let model = score_fit::fit(&others);
            unseen.push(model.map(|model| judged(outcomes, &model)));
            left_out.push(LeftOut {
                name: runs[index].name.clone(),
                frames: outcomes.len(),
                hits: hits(outcomes),
                tracker: row(ScoreModel::TRACKER, outcomes).quality,
                fitted: model.map(|model| row(model, outcomes)),
            });
        }
        let unseen: Option<Vec<Vec<Outcome>>> = unseen.into_iter().collect();
        Ok(Self {
            preset,
            playback: None,
            seeds: runs.iter().map(|runs| runs.seeds.len()).max().unwrap_or(0),
            predictors: PREDICTORS,
            frames: pooled.len(),
            hits: hits(&pooled),
            lost: pooled.iter().filter(|outcome| outcome.lost).count(),
            tracker: row(ScoreModel::TRACKER, &pooled),
            fitted: row(fitted, &pooled),
            leaving_one_out: unseen.map(|unseen| Quality::of(&unseen.concat())),
            sequences: left_out,
        })
    }

    /// Tells how the sequences were played.
    #[must_use]
    pub fn played(mut self, playback: Playback) -> Self {
        self.playback = playback.unusual();
        self
    }
}

fn outcomes(runs: &SequenceRuns) -> Vec<LabelledFrame> {
    let frames = runs.seeds.iter().flat_map(|seed| &seed.scored);
    frames.filter_map(LabelledFrame::of).collect()
}

fn samples(outcomes: &[LabelledFrame]) -> Vec<Sample> {
    let found = outcomes.iter().filter(|outcome| !outcome.lost);
    found.map(|outcome| outcome.sample).collect()
}

fn judged(outcomes: &[LabelledFrame], model: &ScoreModel) -> Vec<Outcome> {
    let judged = outcomes
        .iter()
        .map(|LabelledFrame { sample, lost }| Outcome {
            score: model.score(&sample.predictors, *lost),
            hit: sample.hit,
        });
    judged.collect()
}

fn hits(outcomes: &[LabelledFrame]) -> usize {
    outcomes.iter().filter(|outcome| outcome.sample.hit).count()
}
