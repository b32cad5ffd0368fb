//! The frames of `bagtrack track`: those of a folder, or of a video.

use super::start::Start;
use super::video_info::{Rate, VideoInfo};
use bagtrack_cli::frames;
use bagtrack_ingest::Limits;
use bagtrack_ingest::video::{VideoDecoder, VideoLimits};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::vec::IntoIter;

/// The program that decodes and encodes videos.
pub const FFMPEG: &str = "ffmpeg";

/// A frame.
pub struct FrameFile {
    /// Its number in the folder or the video, from 0.
    pub index: u64,
    /// Seconds since the first frame of the video.
    pub time: Option<f64>,
    /// What messages call it.
    pub shown: String,
    /// The name of its file, where it has one.
    pub file: Option<String>,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Frames in order.
pub struct Frames {
    source: Source,
    /// What messages call the folder or the video.
    shown: String,
    /// The number of the next frame.
    next: u64,
    /// The number of the first frame that is wanted.
    first: u64,
}

enum Source {
    Folder(IntoIter<PathBuf>),
    Video(Box<VideoDecoder>, VideoInfo),
}

impl Frames {
    /// The frames of a folder or a video, from `start` on.
    pub fn open(path: &Path, start: Start) -> Result<Self, Box<dyn Error>> {
        match path.is_file() {
            true => Self::of_video(path, start),
            false => Self::of_folder(path, start),
        }
    }

    fn of_folder(path: &Path, start: Start) -> Result<Self, Box<dyn Error>> {
        let shown = path.display().to_string();
        let Start::Frame(first) = start else {
            let text = "frames of a folder have no times: give --start the number of a frame";
            return Err(format!("{shown}: {text}").into());
        };
        let mut paths = frames::list(path)?;
        let count = paths.len();
        match usize::try_from(first) {
            Ok(index) if index < count => drop(paths.drain(..index)),
            _ => return Err(too_short(&shown, count as u64).into()),
        }
        Ok(Self {
            source: Source::Folder(paths.into_iter()),
            shown,
            next: first,
            first,
        })
    }

    /// Frames before the start are passed over where the file has no index.
    fn of_video(path: &Path, start: Start) -> Result<Self, Box<dyn Error>> {
        let shown = path.display().to_string();
        let path = path.canonicalize()?;
        let info = VideoInfo::read(&path);
        let first = match start {
            Start::Frame(index) => index,
            Start::Time(seconds) => info.frame_at(seconds),
        };
        if let Some(count) = info.count().filter(|count| first >= *count) {
            return Err(too_short(&shown, count).into());
        }
        let limits = Limits::default();
        let limits = VideoLimits {
            max_pixels: limits.max_pixels,
            max_bytes: limits.max_bytes,
            max_pictures: usize::MAX,
        };
        let from = info.seek_to(first);
        let decoder = VideoDecoder::of_file(FFMPEG, &path, from, limits)
            .map_err(|error| format!("{error}; install ffmpeg"))?;
        Ok(Self {
            source: Source::Video(Box::new(decoder), info),
            shown,
            next: from.map_or(0, |_| first),
            first,
        })
    }

    /// Frames a second.
    pub fn rate(&self) -> Rate {
        match &self.source {
            Source::Folder(_) => Rate::default(),
            Source::Video(_, info) => info.rate,
        }
    }

    /// Whether frames have times.
    pub fn have_times(&self) -> bool {
        matches!(self.source, Source::Video(..))
    }

    /// How many frames are left, where that is known.
    pub fn left(&self) -> Option<u64> {
        match &self.source {
            Source::Folder(paths) => Some(paths.len() as u64),
            Source::Video(_, info) => Some(info.count()?.saturating_sub(self.next)),
        }
    }

    /// The number of the first frame that is wanted.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Whether the next frame is before the first that is wanted.
    pub fn are_before_first(&self) -> bool {
        self.next < self.first
    }

    /// Passes over the next frame.
    pub fn pass_over(&mut self) -> Result<(), Box<dyn Error>> {
        let is_there = match &mut self.source {
            Source::Folder(paths) => paths.next().is_some(),
            Source::Video(..) => self.picture()?.is_some(),
        };
        if !is_there {
            return Err(too_short(&self.shown, self.next).into());
        }
        self.next += 1;
        Ok(())
    }

    /// The next frame; none after the last.
    pub fn next(&mut self) -> Result<Option<FrameFile>, Box<dyn Error>> {
        let frame = match &mut self.source {
            Source::Folder(paths) => match paths.next() {
                Some(path) => Some(read(self.next, &path)?),
                None => None,
            },
            Source::Video(..) => self.picture()?,
        };
        self.next += 1;
        Ok(frame)
    }

    /// The next picture of a video.
    fn picture(&mut self) -> Result<Option<FrameFile>, Box<dyn Error>> {
        let Source::Video(decoder, info) = &mut self.source else {
            return Ok(None);
        };
        let (index, shown) = (self.next, format!("{}, frame {}", self.shown, self.next));
        let picture = decoder.next_picture();
        let picture = picture.map_err(|error| format!("{shown}: {error}"))?;
        if picture.is_none() && index == self.first {
            return Err(format!("{}: there are no pictures in it", self.shown).into());
        }
        Ok(picture.map(|bytes| FrameFile {
            index,
            time: Some(info.time(index)),
            shown,
            file: None,
            bytes,
        }))
    }
}

fn too_short(shown: &str, count: u64) -> String {
    format!("{shown}: --start is after its last frame: it has {count} frames, counted from 0")
}

fn read(index: u64, path: &Path) -> Result<FrameFile, String> {
    let shown = path.display().to_string();
    let bytes = fs::read(path).map_err(|error| format!("{shown}: {error}"))?;
    let file = path.file_name().unwrap_or_default();
    Ok(FrameFile {
        index,
        time: None,
        shown,
        file: Some(file.to_string_lossy().into_owned()),
        bytes,
    })
}
