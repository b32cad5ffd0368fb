//! The frames of a folder, in order, and why a folder is refused.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

/// Where the frames of `dir` are: in `img/` where there is such a folder (OTB layout), in `dir` itself otherwise.
fn folder(dir: &Path) -> PathBuf {
    let pictures = dir.join("img");
    if pictures.is_dir() {
        pictures
    } else {
        dir.to_owned()
    }
}

/// The JPEG, PNG and WebP files in `img/` under `dir` (OTB layout), or in `dir` itself where there is no such folder,
/// by name; numbers in names are compared as numbers.
///
/// # Errors
/// The folder cannot be read, or holds no frames.
pub fn list(dir: &Path) -> Result<Vec<PathBuf>, SequenceError> {
    let frames = files(dir, &["jpg", "jpeg", "png", "webp"])?;
    if frames.is_empty() {
        return Err(SequenceError::new(
            dir,
            "there are no JPEG, PNG or WebP frames in it, nor in img/ under it",
        ));
    }
    Ok(frames)
}

/// Images of types that are not read, in the folder of the frames of [`list`].
///
/// # Errors
/// The folder cannot be read.
pub fn unread(dir: &Path) -> Result<Vec<PathBuf>, SequenceError> {
    let endings = [
        "tif", "tiff", "bmp", "heic", "heif", "avif", "gif", "dng", "jp2", "jxl", "ppm", "pgm",
    ];
    files(dir, &endings)
}

/// The files with these endings, by name.
fn files(dir: &Path, endings: &[&str]) -> Result<Vec<PathBuf>, SequenceError> {
    let pictures = folder(dir);
    let unreadable = |error: std::io::Error| SequenceError::new(dir, error.to_string());
    let mut frames = Vec::new();
    for entry in fs::read_dir(&pictures).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        // macOS writes a file ._NAME beside NAME on foreign file systems.
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        let path = entry.path();
        let extension = path.extension().and_then(|extension| extension.to_str());
        let is_frame = extension
            .is_some_and(|extension| endings.contains(&extension.to_ascii_lowercase().as_str()));
        if is_frame && path.is_file() {
            frames.push(path);
        }
    }
    frames.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(frames)
}

/// Compares text piece by piece, runs of digits as numbers: frame2 comes before frame10.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut a_rest, mut b_rest) = (a, b);
    while let (Some(a_first), Some(b_first)) = (a_rest.chars().next(), b_rest.chars().next()) {
        let order = if a_first.is_ascii_digit() && b_first.is_ascii_digit() {
            let (a_number, b_number) = (number(&mut a_rest), number(&mut b_rest));
            a_number
                .len()
                .cmp(&b_number.len())
                .then(a_number.cmp(b_number))
        } else {
            a_rest = &a_rest[a_first.len_utf8()..];
            b_rest = &b_rest[b_first.len_utf8()..];
            a_first.cmp(&b_first)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    a_rest.len().cmp(&b_rest.len()).then(a.cmp(b))
}

/// Takes the digits from the start of `text`, and returns them without leading zeros.
fn number<'a>(text: &mut &'a str) -> &'a str {
    let end = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    *text = rest;
    digits.trim_start_matches('0')
}

/// A sequence cannot be used; the text is one line and names the folder.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {reason}", dir.display())]
pub struct SequenceError {
    dir: PathBuf,
    reason: String,
}

impl SequenceError {
    /// A reason for the folder `dir`.
    pub fn new(dir: &Path, reason: impl Into<String>) -> Self {
        Self {
            dir: dir.to_owned(),
            reason: reason.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["f10.jpg", "f2.jpg", "f1.jpg", "f0003.jpg", "e99.jpg"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(
            names,
            ["e99.jpg", "f1.jpg", "f2.jpg", "f0003.jpg", "f10.jpg"]
        );
    }

    #[test]
    fn names_that_differ_only_in_leading_zeros_still_have_an_order() {
        assert_eq!(
            natural("f1.jpg", "f01.jpg").reverse(),
            natural("f01.jpg", "f1.jpg")
        );
        assert_ne!(natural("f1.jpg", "f01.jpg"), Ordering::Equal);
    }
}
