//! The answers of runs as text files, as the toolkits of OTB and pysot read them.
//!
//! A file for each sequence, named after it: `x,y,width,height` a line for each frame, the first one included. Boxes
//! are 1-based, as in the sequence's own file. With several seeds each has a folder, `seed-0` and so on: the toolkits
//! take each folder for a tracker.
//!
//! The figures of each scored frame go into one file: a line of JSON a frame.

use super::run::SequenceRuns;
use serde_json::json;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// A file of results cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct ResultsError {
    path: PathBuf,
    reason: String,
}

impl ResultsError {
    fn new(path: &Path, reason: impl ToString) -> Self {
        Self {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}

/// Refuses to write sequences to `path` that could not be told apart there.
fn check_names(path: &Path, sequences: &[SequenceRuns]) -> Result<(), ResultsError> {
    for (index, runs) in sequences.iter().enumerate() {
        if sequences[..index].iter().any(|it| it.name == runs.name) {
            let reason = format!("two sequences are called {}", runs.name);
            return Err(ResultsError::new(path, reason));
        }
    }
    Ok(())
}

/// Writes the answers of all seeds on these sequences into `dir`, over files of these names.
///
/// # Errors
/// A folder or file cannot be written, or two sequences have one name.
pub fn write(dir: &Path, sequences: &[SequenceRuns]) -> Result<(), ResultsError> {
    check_names(dir, sequences)?;
    for runs in sequences {
        for (seed, run) in runs.seeds.iter().enumerate() {
            let folder = match runs.seeds.len() {
                1 => dir.to_owned(),
                _ => dir.join(format!("seed-{seed}")),
            };
            fs::create_dir_all(&folder).map_err(|error| ResultsError::new(&folder, error))?;
            let file = folder.join(format!("{}.txt", runs.name));
            let lines = run.boxes.iter().fold(String::new(), |mut text, it| {
                let (x, y) = (it.x + 1.0, it.y + 1.0);
                let written = writeln!(text, "{x:.3},{y:.3},{:.3},{:.3}", it.width, it.height);
                written.expect("a string takes any text");
                text
            });
            fs::write(&file, lines).map_err(|error| ResultsError::new(&file, error))?;
        }
    }
    Ok(())
}

/// Writes the scored frames of all seeds on these sequences into `file`, with the predictors of the score
/// ([`Evidence::predictors`](bagtrack_tracker::Evidence::predictors)).
///
/// # Errors
/// The file cannot be written, or two sequences have one name.
pub fn write_frames(file: &Path, sequences: &[SequenceRuns]) -> Result<(), ResultsError> {
    check_names(file, sequences)?;
    let mut lines = String::new();
    for runs in sequences {
        for (seed, run) in runs.seeds.iter().enumerate() {
            for frame in &run.scored {
                let line = json!({
                    "sequence": runs.name,
                    "seed": seed,
                    "frame": frame.index,
                    "center_error": frame.center_error,
                    "overlap": frame.overlap,
                    "score": frame.score,
                    "status": frame.status,
                    "predictors": frame.evidence.and_then(|evidence| evidence.predictors()),
                });
                lines += &format!("{line}\n");
            }
        }
    }
    fs::write(file, lines).map_err(|error| ResultsError::new(file, error))
}
