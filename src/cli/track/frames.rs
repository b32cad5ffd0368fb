//! The frames of `bagtrack track`: those of a folder, or of a video.

use super::start::Start;
use super::video_info::{Rate, VideoInfo};
use bagtrack::eval::frames;
use bagtrack::ingest::Limits;
use bagtrack::ingest::video::{VideoDecoder, VideoLimits};
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
}

enum Source {
    Folder(IntoIter<PathBuf>),
    Video(Box<VideoDecoder>, VideoInfo),
}

impl Frames {
    /// The frames of a folder or a video.
    pub fn open(path: &Path) -> Result<Self, Box<dyn Error>> {
        let shown = path.display().to_string();
        let source = match path.is_file() {
            true => open_video(path)?,
            false => Source::Folder(frames::list(path)?.into_iter()),
        };
        Ok(Self {
            source,
            shown,
            next: 0,
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

    /// The number of the next frame.
    pub fn next_index(&self) -> u64 {
        self.next
    }

    /// The number of the frame that `start` names.
    pub fn find(&self, start: Start) -> Result<u64, String> {
        let index = match (start, &self.source) {
            (Start::Frame(index), _) => index,
            (Start::Time(seconds), Source::Video(_, info)) => info.frame_at(seconds),
            (Start::Time(_), Source::Folder(_)) => {
                let text = "frames of a folder have no times: give --start the number of a frame";
                return Err(format!("{}: {text}", self.shown));
            }
        };
        match self.left().map(|left| self.next + left) {
            Some(count) if index >= count => Err(self.too_short(count)),
            _ => Ok(index),
        }
    }

    /// Passes over the next frame.
    pub fn pass_over(&mut self) -> Result<(), Box<dyn Error>> {
        let is_there = match &mut self.source {
            Source::Folder(paths) => paths.next().is_some(),
            Source::Video(..) => self.picture()?.is_some(),
        };
        if !is_there {
            return Err(self.too_short(self.next).into());
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
        if picture.is_none() && index == 0 {
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

    fn too_short(&self, count: u64) -> String {
        let shown = &self.shown;
        format!("{shown}: --start is after its last frame: it has {count} frames, counted from 0")
    }
}

fn open_video(path: &Path) -> Result<Source, Box<dyn Error>> {
    let limits = Limits::default();
    let limits = VideoLimits {
        max_pixels: limits.max_pixels,
        max_bytes: limits.max_bytes,
        max_pictures: usize::MAX,
    };
    let path = path.canonicalize()?;
    let decoder = VideoDecoder::of_file(FFMPEG, &path, limits)
        .map_err(|error| format!("{error}; install ffmpeg"))?;
    Ok(Source::Video(Box::new(decoder), VideoInfo::read(&path)))
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
