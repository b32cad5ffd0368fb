//! Figures, drawn as SVG: the precision plot and the success plot of the benchmark (Wu, Lim and Yang 2013), with a
//! curve for each evaluated variant, and the centre error over time, one figure a sequence.
//!
//! In: the [`Evaluated`] variants. Out: SVG files in a folder. No font is read: the viewer sets the text in its own
//! sans-serif font, and labels stand where their width does not matter.
//!
//! What can go wrong ([`PlotError`]): the folder or a file in it cannot be written. A sequence's name may not be a
//! valid file name: every character except letters, digits, `-`, `_` and `.` becomes `_`, and a repeated name gets a
//! number.

mod count;
mod curves;
mod evaluated;
mod over_time;
mod style;

pub use evaluated::Evaluated;

use std::fs;
use std::path::{Path, PathBuf};

/// A figure cannot be drawn or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct PlotError {
    path: PathBuf,
    reason: String,
}

/// Makes the folder for the figures, or takes the one that is there.
///
/// # Errors
/// It cannot be made.
pub fn prepare(dir: &Path) -> Result<(), PlotError> {
    fs::create_dir_all(dir).map_err(|error| PlotError {
        path: dir.to_owned(),
        reason: error.to_string(),
    })
}

/// Draws `precision.svg`, `success.svg` and an `error-NAME.svg` for each sequence into `dir`, over files of these
/// names. The figures over time show the first three variants only: more could not be told apart.
///
/// # Errors
/// See [`PlotError`].
pub fn draw(dir: &Path, evaluated: &[Evaluated]) -> Result<(), PlotError> {
    prepare(dir)?;
    let write = |name: &str, figure: style::Drawn| {
        let path = dir.join(name);
        let written = figure
            .map_err(|error| error.to_string())
            .and_then(|svg| fs::write(&path, svg).map_err(|error| error.to_string()));
        written.map_err(|reason| PlotError { path, reason })
    };
    write("precision.svg", curves::precision(evaluated))?;
    write("success.svg", curves::success(evaluated))?;
    let Some(first) = evaluated.first() else {
        return Ok(());
    };
    let mut names: Vec<String> = Vec::new();
    for (index, sequence) in first.runs.iter().enumerate() {
        let plain = file_name(&sequence.name);
        let mut name = plain.clone();
        for number in 2.. {
            if !names.contains(&name) {
                break;
            }
            name = format!("{plain}-{number}");
        }
        write(
            &format!("error-{name}.svg"),
            over_time::figure(evaluated, index),
        )?;
        names.push(name);
    }
    Ok(())
}

fn file_name(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    name.chars()
        .map(|c| if plain(c) { c } else { '_' })
        .collect()
}
