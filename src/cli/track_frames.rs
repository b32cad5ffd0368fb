//! The frames of `bagtrack track`: those of a folder, or of a video.

use bagtrack_cli::frames;
use bagtrack_ingest::Limits;
use bagtrack_ingest::video::{VideoDecoder, VideoLimits};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::vec::IntoIter;

/// The program that decodes and encodes videos.
pub const FFMPEG: &str = "ffmpeg";
/// The one that tells about them.
const FFPROBE: &str = "ffprobe";
/// Frames a second where nothing tells.
const USUAL_RATE: &str = "25";

/// A frame.
pub struct FrameFile {
    /// What messages call it.
    pub shown: String,
    /// The name of its file, where it has one.
    pub file: Option<String>,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Frames in order.
pub enum Frames {
    /// Of a folder.
    Folder(IntoIter<PathBuf>),
    /// Of a video.
    Video(Box<Video>),
}

/// A video.
pub struct Video {
    decoder: VideoDecoder,
    shown: String,
    rate: String,
    count: Option<u64>,
    read: u64,
}

impl Frames {
    /// The frames of a folder or a video.
    pub fn open(path: &Path) -> Result<Self, Box<dyn Error>> {
        if !path.is_file() {
            return Ok(Self::Folder(frames::list(path)?.into_iter()));
        }
        let limits = Limits::default();
        let limits = VideoLimits {
            max_pixels: limits.max_pixels,
            max_bytes: limits.max_bytes,
            max_pictures: usize::MAX,
        };
        let path = path.canonicalize()?;
        let decoder = VideoDecoder::of_file(FFMPEG, &path, limits)
            .map_err(|error| format!("{error}; install ffmpeg"))?;
        let about = about(&path);
        let entry = |name: &str| {
            let mut lines = about.lines();
            lines.find_map(|line| line.strip_prefix(name)?.strip_prefix('='))
        };
        let is_rate = |rate: &&str| !rate.is_empty() && !rate.starts_with("0/") && *rate != "N/A";
        Ok(Self::Video(Box::new(Video {
            decoder,
            shown: path.display().to_string(),
            rate: entry("avg_frame_rate")
                .filter(is_rate)
                .unwrap_or(USUAL_RATE)
                .to_owned(),
            count: entry("nb_frames").and_then(|count| count.parse().ok()),
            read: 0,
        })))
    }

    /// Frames a second, as a number or a fraction.
    pub fn rate(&self) -> &str {
        match self {
            Self::Folder(_) => USUAL_RATE,
            Self::Video(video) => &video.rate,
        }
    }

    /// How many there are, where that is known.
    pub fn count(&self) -> Option<u64> {
        match self {
            Self::Folder(paths) => Some(paths.len() as u64),
            Self::Video(video) => video.count,
        }
    }

    /// The next frame; none after the last.
    pub fn next(&mut self) -> Result<Option<FrameFile>, Box<dyn Error>> {
        match self {
            Self::Folder(paths) => paths.next().map(read).transpose(),
            Self::Video(video) => video.next(),
        }
    }
}

impl Video {
    fn next(&mut self) -> Result<Option<FrameFile>, Box<dyn Error>> {
        let shown = format!("{}, frame {}", self.shown, self.read);
        let picture = self.decoder.next_picture();
        let picture = picture.map_err(|error| format!("{shown}: {error}"))?;
        if picture.is_none() && self.read == 0 {
            return Err(format!("{}: there are no pictures in it", self.shown).into());
        }
        self.read += 1;
        Ok(picture.map(|bytes| FrameFile {
            shown,
            file: None,
            bytes,
        }))
    }
}

fn read(path: PathBuf) -> Result<FrameFile, Box<dyn Error>> {
    let shown = path.display().to_string();
    let bytes = fs::read(&path).map_err(|error| format!("{shown}: {error}"))?;
    let file = path.file_name().unwrap_or_default();
    Ok(FrameFile {
        shown,
        file: Some(file.to_string_lossy().into_owned()),
        bytes,
    })
}

/// What is known about a video, as name=value a line; nothing where that cannot be told.
fn about(path: &Path) -> String {
    let mut command = Command::new(FFPROBE);
    command.args([
        "-v",
        "error",
        "-select_streams",
        "v:0",
        "-of",
        "default=nw=1",
    ]);
    command.args(["-show_entries", "stream=avg_frame_rate,nb_frames"]);
    let output = command.arg(path).output();
    output.map_or_else(
        |_| String::new(),
        |output| String::from_utf8_lossy(&output.stdout).into_owned(),
    )
}
