//! What a command writes: folders, standard output, and progress bars, on standard error and only where that is a
//! terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::fs;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;

/// Makes the folder `dir`, or takes an existing one if it is empty, so that no file is overwritten.
pub fn new_folder(dir: &Path) -> Result<(), String> {
    fs::create_dir_all(dir).map_err(|error| format!("{}: {error}", dir.display()))?;
    let mut entries = fs::read_dir(dir).map_err(|error| format!("{}: {error}", dir.display()))?;
    if entries.next().is_some() {
        return Err(format!(
            "{} is not empty: choose another folder, or remove it first",
            dir.display()
        ));
    }
    Ok(())
}

/// Writes `text` to standard output. A reader that ends early, as in `bagtrack eval … | head`, is not an error.
pub fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// A bar of `length` steps, or a count where that is not known; hidden where standard error is not a terminal.
pub fn bar_or_count(length: Option<u64>, what: &'static str) -> ProgressBar {
    match length {
        Some(length) => bar(length, what),
        None if !std::io::stderr().is_terminal() => ProgressBar::hidden(),
        None => {
            let style = ProgressStyle::with_template("{msg} {spinner} {pos}")
                .expect("the template is a constant that is in order");
            ProgressBar::new_spinner()
                .with_style(style)
                .with_message(what)
        }
    }
}

/// A bar of `length` steps; a hidden one where standard error is not a terminal.
pub fn bar(length: u64, what: &'static str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
        .expect("the template is a constant that is in order");
    ProgressBar::new(length)
        .with_style(style)
        .with_message(what)
}
