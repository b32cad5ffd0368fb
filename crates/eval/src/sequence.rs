//! A sequence in the OTB layout: `img/` with the frames and `groundtruth_rect.txt` with a box a line.

use super::playback::Playback;
use bagtrack_cli::{BOXES, SequenceError, frames, read_boxes};
use bagtrack_ingest::Limits;
use bagtrack_tracker::{Frame, FrameFormat, Params, Rect};
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
    playback: Playback,
    /// The frames in the format that was asked for last.
    decoded: Mutex<Option<Decoded>>,
    /// The box of each frame in 0-based pixels from the top-left corner; none where the frame is not annotated.
    pub boxes: Vec<Option<Rect>>,
}

/// All frames of a sequence in one format.
type Decoded = (FrameFormat, Arc<Vec<Frame>>);

impl Sequence {
    /// Reads a sequence, from its first frame to its last.
    ///
    /// # Errors
    /// As [`Self::load_played`]; also a first frame without a box.
    pub fn load(dir: &Path, limits: &Limits) -> Result<Self, SequenceError> {
        Self::load_played(dir, Playback::default(), limits)
    }

    /// Reads the frames of a sequence that `playback` plays, in the order in which it plays them.
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
        let boxes = read_boxes(dir)?;
        if boxes.len() != paths.len() {
            return Err(refuse(format!(
                "{} frames, but {} lines in {}",
                paths.len(),
                boxes.len(),
                BOXES
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
            playback,
            decoded: Mutex::default(),
            boxes: order.into_iter().map(|index| boxes[index]).collect(),
        })
    }

    /// The box that a run with this seed begins with; none where there is no box to start with.
    pub fn first_box(&self, seed: usize) -> Option<Rect> {
        self.boxes[0].map(|annotated| self.playback.first_box(annotated, seed))
    }

    /// The frames as the service decodes them for a session with `params` that starts with the box `first`; decoded
    /// once for sessions with the same format that follow each other.
    ///
    /// # Errors
    /// A frame that is unreadable.
    pub fn frames(&self, params: &Params, first: &Rect) -> Result<Arc<Vec<Frame>>, SequenceError> {
        let refuse = |reason: String| SequenceError::new(&self.dir, reason);
        let mut decoded = self.decoded.lock().unwrap_or_else(PoisonError::into_inner);
        let wanted = |source| params.frame_format(source, first);
        let read = |path: &PathBuf, format: &dyn Fn((u32, u32)) -> FrameFormat| {
            let file = path.file_name().unwrap_or_default().display();
            let bytes = fs::read(path).map_err(|error| refuse(format!("{file}: {error}")))?;
            bagtrack_ingest::decode_to(&bytes, &self.limits, format)
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
}
