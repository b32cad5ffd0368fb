//! Progress bars, on standard error and only where that is a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;

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
