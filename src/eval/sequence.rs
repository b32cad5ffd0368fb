//! A sequence in the OTB layout: `img/` with the frames and `groundtruth_rect.txt` with a box a line.

use super::frames;
use super::playback::Playback;
use super::sequence_error::SequenceError;
use crate::ingest::{self, Limits};
use crate::tracker::{Frame, FrameFormat, Params, Rect};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Frames with the boxes that people drew on them, in the order in which they are played.
#[derive(Debug)]
pub struct Sequence {
    /// Name of the folder.
    pub name: String,
    /// The folder, and the file of each frame.
    dir: PathBuf,
    files: Vec<PathBuf>,
    limits: Limits,
    /// The frames in the format that was asked for last.
    decoded: Mutex<Option<Decoded>>,
    /// The box of each frame in 0-based pixels from the top-left corner; none where the frame is not annotated.
    pub boxes: Vec<Option<Rect>>,
}

/// All frames of a sequence in one format.
type Decoded = (FrameFormat, Arc<Vec<Frame>>);

impl Sequence {
    /// Name of the file with the boxes.
    pub const BOXES: &'static str = "groundtruth_rect.txt";

    /// Reads a sequence, from its first frame to its last.
    ///
    /// # Errors
    /// As [`Self::load_played`]; a first frame without a box is one.
    pub fn load(dir: &Path, limits: &Limits) -> Result<Self, SequenceError> {
        Self::load_played(dir, Playback::default(), limits)
    }

    /// Reads the frames of a sequence that are played, in that order.
    ///
    /// # Errors
    /// A missing or unreadable folder, file or frame; another number of boxes than frames; no box to start with.
    pub fn load_played(
        dir: &Path,
        playback: Playback,
        limits: &Limits,
    ) -> Result<Self, SequenceError> {
        let refuse = |reason: String| SequenceError::new(dir, reason);
        let paths = frames::list(dir)?;
        let boxes = Self::read_boxes(dir)?;
        if boxes.len() != paths.len() {
            return Err(refuse(format!(
                "{} frames, but {} lines in {}",
                paths.len(),
                boxes.len(),
                Self::BOXES
            )));
        }
        let order = playback.order(&boxes).map_err(refuse)?;
        let name = dir.canonicalize().ok().unwrap_or_else(|| dir.to_owned());
        Ok(Self {
            name: name
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            dir: dir.to_owned(),
            files: order.iter().map(|&index| paths[index].clone()).collect(),
            limits: *limits,
            decoded: Mutex::default(),
            boxes: order.into_iter().map(|index| boxes[index]).collect(),
        })
    }

    /// The frames as the service decodes them for a session with `params` that starts with the first box; decoded once
    /// for parameters with the same format.
    ///
    /// # Errors
    /// A frame that is unreadable, or no first box.
    pub fn frames(&self, params: &Params) -> Result<Arc<Vec<Frame>>, SequenceError> {
        let refuse = |reason: String| SequenceError::new(&self.dir, reason);
        let first = self.boxes[0].ok_or_else(|| refuse("its first frame has no box".to_owned()))?;
        let mut decoded = self.decoded.lock().unwrap_or_else(PoisonError::into_inner);
        let wanted = |source| params.frame_format(source, &first);
        let read = |path: &PathBuf, format: &dyn Fn((u32, u32)) -> FrameFormat| {
            let file = path.file_name().unwrap_or_default().display();
            let bytes = fs::read(path).map_err(|error| refuse(format!("{file}: {error}")))?;
            ingest::decode_to(&bytes, &self.limits, format)
                .map_err(|error| refuse(format!("{file}: {error}")))
        };
        let source = read(&self.files[0], &wanted)?.source_size();
        let format = wanted(source);
        if let Some((_, frames)) = decoded.as_ref().filter(|(known, _)| *known == format) {
            return Ok(frames.clone());
        }
        let frames = self.files.iter().map(|path| read(path, &|_| format));
        let frames = Arc::new(frames.collect::<Result<Vec<Frame>, SequenceError>>()?);
        *decoded = Some((format, frames.clone()));
        Ok(frames)
    }

    /// Reads the boxes of the sequence in `dir`.
    ///
    /// # Errors
    /// The file is missing, or a line of it is not four numbers.
    pub fn read_boxes(dir: &Path) -> Result<Vec<Option<Rect>>, SequenceError> {
        let text = fs::read_to_string(dir.join(Self::BOXES))
            .map_err(|error| SequenceError::new(dir, format!("{}: {error}", Self::BOXES)))?;
        parse_boxes(&text)
            .map_err(|reason| SequenceError::new(dir, format!("{}: {reason}", Self::BOXES)))
    }
}

/// Reads OTB boxes, `x,y,width,height` a line, separated by commas, tabs or spaces: 1-based in the text, 0-based in
/// the answer. A box without size (`0,0,0,0`) or with a NaN in it means that the frame is not annotated.
///
/// # Errors
/// Says which line is not four numbers.
pub fn parse_boxes(text: &str) -> Result<Vec<Option<Rect>>, String> {
    text.trim_end()
        .lines()
        .enumerate()
        .map(|(index, line)| {
            let numbers: Option<Vec<f64>> = line
                .split(|c: char| c == ',' || c.is_whitespace())
                .filter(|field| !field.is_empty())
                .map(|field| field.parse().ok())
                .collect();
            match numbers.as_deref() {
                Some(&[x, y, width, height]) => {
                    let annotated = [x, y, width, height].iter().all(|n| n.is_finite())
                        && width > 0.0
                        && height > 0.0;
                    Ok(annotated.then_some(Rect {
                        x: x - 1.0,
                        y: y - 1.0,
                        width,
                        height,
                    }))
                }
                _ => Err(format!(
                    "line {} is not x,y,width,height: {line:?}",
                    index + 1
                )),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_may_be_separated_by_commas_tabs_or_spaces() {
        let expected = Some(Rect {
            x: 0.0,
            y: 1.5,
            width: 3.0,
            height: 4.0,
        });
        for text in [
            "1,2.5,3,4",
            "1\t2.5\t3\t4",
            "1 2.5 3 4\r\n",
            " 1, 2.5, 3, 4 \n\n",
        ] {
            assert_eq!(parse_boxes(text), Ok(vec![expected]), "{text:?}");
        }
    }

    #[test]
    fn boxes_without_size_are_not_annotations() {
        assert_eq!(
            parse_boxes("0,0,0,0\nNaN,NaN,NaN,NaN\n5,5,10,-1"),
            Ok(vec![None; 3])
        );
    }

    #[test]
    fn a_broken_line_is_named() {
        let error = parse_boxes("1,2,3,4\n1,2,3\n").expect_err("three numbers are no box");
        assert!(error.contains("line 2"), "{error}");
    }
}
