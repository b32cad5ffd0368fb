//! The frames of `bagtrack track`, from a folder or a video, forwards or backwards.

use super::reversed::Reversed;
use super::start::Start;
use super::video_info::{FFMPEG, Rate, VideoInfo};
use bagtrack_cli::frames;
use bagtrack_ingest::video::{VideoDecoder, VideoLimits};
use bagtrack_ingest::{Limits, is_text, unread_type};
use std::error::Error;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::vec::IntoIter;

pub struct FrameFile {
    /// Its number in the folder or the video, from 0.
    pub index: u64,
    /// Seconds since the first frame of the video.
    pub time: Option<f64>,
    /// Its name in messages.
    pub shown: String,
    /// The name of its file; `None` for a frame of a video.
    pub file: Option<String>,
    pub bytes: Vec<u8>,
}

/// In which direction of time frames are tracked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    Forwards,
    Backwards,
}

/// Frames in the order in which they are tracked.
pub struct Frames {
    source: Source,
    direction: Direction,
    /// The name of the folder or the video in messages.
    shown: String,
    /// The number of the next frame; `None` after frame 0 on the way backwards.
    next: Option<u64>,
    /// The number of the first frame that is wanted.
    first: u64,
}

enum Source {
    /// The files that are still to be tracked, and how many the folder has.
    Folder(IntoIter<PathBuf>, u64),
    Video(Pictures, VideoInfo),
}

enum Pictures {
    Forwards(Box<VideoDecoder>),
    Backwards(Reversed),
}

impl Frames {
    /// The frames of a folder or a video, from `start` on.
    pub fn open(path: &Path, start: Start, direction: Direction) -> Result<Self, Box<dyn Error>> {
        let file = match path.metadata() {
            Err(_) if is_no_path(path) => return Err(no_file(path)),
            file => file.map_err(|error| format!("{}: {error}", path.display()))?,
        };
        if file.is_dir() {
            Self::of_folder(path, start, direction)
        } else if file.is_file() {
            Self::of_video(path, start, direction)
        } else {
            Err(no_file(path))
        }
    }

    fn of_folder(path: &Path, start: Start, direction: Direction) -> Result<Self, Box<dyn Error>> {
        let shown = path.display().to_string();
        let Start::Frame(first) = start else {
            let text = "frames of a folder have no times: give --start the number of a frame";
            return Err(format!("{shown}: {text}").into());
        };
        let mut paths = frames::list(path)?;
        if let Some(unread) = frames::unread(path)?.first() {
            eprintln!(
                "bagtrack: {} is passed over, as are other images that are no JPEG, PNG or WebP files",
                unread.display()
            );
        }
        let count = paths.len();
        let index = usize::try_from(first).unwrap_or(usize::MAX);
        if index >= count {
            return Err(too_short(&shown, count as u64).into());
        }
        match direction {
            Direction::Forwards => drop(paths.drain(..index)),
            Direction::Backwards => {
                paths.truncate(index + 1);
                paths.reverse();
            }
        }
        Ok(Self {
            source: Source::Folder(paths.into_iter(), count as u64),
            direction,
            shown,
            next: Some(first),
            first,
        })
    }

    /// Opens a video. Where the file has no index, frames before the start are decoded and passed over.
    fn of_video(path: &Path, start: Start, direction: Direction) -> Result<Self, Box<dyn Error>> {
        let shown = path.display().to_string();
        check_is_video(path)?;
        let path = path
            .canonicalize()
            .map_err(|error| format!("{shown}: {error}"))?;
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
        let (pictures, next) = match direction {
            Direction::Forwards => {
                let (next, from) = info.seek_to(first).unzip();
                let next = next.unwrap_or(0);
                let decoder = VideoDecoder::of_file(FFMPEG, &path, from, limits)
                    .map_err(|error| format!("{error}; install ffmpeg"))?;
                (Pictures::Forwards(Box::new(decoder)), next)
            }
            Direction::Backwards => {
                let reversed = Reversed::new(path, limits, first);
                (Pictures::Backwards(reversed), first)
            }
        };
        Ok(Self {
            source: Source::Video(pictures, info),
            direction,
            shown,
            next: Some(next),
            first,
        })
    }

    pub fn rate(&self) -> Rate {
        match &self.source {
            Source::Folder(..) => Rate::default(),
            Source::Video(_, info) => info.rate,
        }
    }

    pub fn have_times(&self) -> bool {
        matches!(self.source, Source::Video(..))
    }

    /// How many frames the folder or video has, where that is known.
    pub fn count(&self) -> Option<u64> {
        match &self.source {
            Source::Folder(_, count) => Some(*count),
            Source::Video(_, info) => info.count(),
        }
    }

    /// Whether there is a frame after `length` frames.
    pub fn go_on_after(&mut self, length: u64) -> bool {
        match self.count() {
            Some(count) => length < count,
            None => self.next().is_ok_and(|frame| frame.is_some()),
        }
    }

    /// How many frames are left, where that is known.
    pub fn left(&self) -> Option<u64> {
        match (&self.source, self.direction) {
            (Source::Folder(paths, _), _) => Some(paths.len() as u64),
            (Source::Video(..), Direction::Backwards) => Some(self.next.map_or(0, |next| next + 1)),
            (Source::Video(_, info), Direction::Forwards) => {
                Some(info.count()?.saturating_sub(self.next?))
            }
        }
    }

    /// The number of the first frame that is wanted.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Whether the next frame is before the first that is wanted.
    pub fn are_before_first(&self) -> bool {
        self.direction == Direction::Forwards && self.next.is_some_and(|next| next < self.first)
    }

    /// Passes over the next frame.
    pub fn pass_over(&mut self) -> Result<(), Box<dyn Error>> {
        let passed = self.next.unwrap_or(0);
        match self.next()? {
            Some(_) => Ok(()),
            None => Err(too_short(&self.shown, passed).into()),
        }
    }

    /// The next frame; `None` after the last.
    pub fn next(&mut self) -> Result<Option<FrameFile>, Box<dyn Error>> {
        let Some(index) = self.next else {
            return Ok(None);
        };
        self.next = match self.direction {
            Direction::Forwards => Some(index + 1),
            Direction::Backwards => index.checked_sub(1),
        };
        match &mut self.source {
            Source::Folder(paths, _) => match paths.next() {
                Some(path) => Ok(Some(read(index, &path)?)),
                None => Ok(None),
            },
            Source::Video(pictures, info) => {
                let shown = format!("{}, frame {index}", self.shown);
                let picture = match pictures {
                    Pictures::Forwards(decoder) => {
                        let picture = decoder.next_picture().map_err(Box::from);
                        picture.map(|picture| picture.map(|picture| picture.jpeg))
                    }
                    Pictures::Backwards(reversed) => reversed.next_picture(info),
                };
                let picture = picture.map_err(|error| format!("{shown}: {error}"))?;
                if picture.is_none() && index == self.first {
                    return Err(no_picture(&self.shown, index, self.direction).into());
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
    }
}

/// Why a video has no picture of this number.
fn no_picture(shown: &str, index: u64, direction: Direction) -> String {
    match (direction, index) {
        (Direction::Backwards, 1..) => format!("{shown}: --start is after its last frame"),
        _ => format!("{shown}: there are no pictures in it"),
    }
}

fn too_short(shown: &str, count: u64) -> String {
    format!("{shown}: --start is after its last frame: it has {count} frames, counted from 0")
}

/// Whether the path is standard input or a URL, which ffmpeg would take, but `track` does not.
fn is_no_path(path: &Path) -> bool {
    path == Path::new("-") || path.to_string_lossy().contains("://")
}

fn no_file(path: &Path) -> Box<dyn Error> {
    let text = "it is no file and no folder: save the video to a file first";
    format!("{}: {text}", path.display()).into()
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

/// Refuses photos, archives and texts with an error that names their type: ffmpeg would call them damaged videos.
fn check_is_video(path: &Path) -> Result<(), Box<dyn Error>> {
    let mut start = Vec::new();
    let file = fs::File::open(path);
    let read = file.and_then(|file| file.take(4096).read_to_end(&mut start));
    read.map_err(|error| format!("{}: {error}", path.display()))?;
    let told = match unread_type(&start) {
        Some(name @ ("HEIC" | "HEIF" | "AVIF")) => format!("is a photo ({name}), not a video"),
        Some(name @ ("gzip" | "ZIP")) => format!("is packed ({name}): unpack it first"),
        None if start.is_empty() => "is empty".to_owned(),
        None if is_text(&start) => "is a text, not a video".to_owned(),
        _ => return Ok(()),
    };
    Err(format!("{} {told}", path.display()).into())
}
