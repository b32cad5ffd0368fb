//! What `bagtrack track --draw` writes: a folder of pictures, or a video.

use super::frames::FrameFile;
use super::video_file::{self, VideoFile};
use super::video_info::Rate;
use bagtrack::drawing::{self, Picture};
use bagtrack_cli::output;
use bagtrack_ingest::Limits;
use bagtrack_tracker::Estimate;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// Where drawn frames go.
#[derive(Debug)]
pub enum Destination {
    /// Pictures, into this folder.
    Folder(PathBuf),
    /// A video, into this file.
    Video(PathBuf),
}

/// Takes the drawn frames.
pub enum Drawn {
    /// Pictures in a folder.
    Folder(PathBuf),
    /// A video, and the time of its first frame in the source, in seconds, where frames have times.
    Video(VideoFile, Option<f64>),
}

impl Destination {
    /// The destination that `out` names: a new folder if `out` has no ending, or a slash at its end; else a new video.
    pub fn of(out: &Path) -> Result<Self, String> {
        let shown = out.display();
        let has_slash = out.to_string_lossy().ends_with(std::path::is_separator);
        if has_slash || out.is_dir() || out.extension().is_none() {
            output::new_folder(out)?;
            return Ok(Self::Folder(out.to_owned()));
        }
        if !video_file::is_video(out) {
            return Err(format!(
                "--draw {shown}: it can write a video ({}), or a folder of JPEG files, as {shown}/",
                video_file::endings()
            ));
        }
        if out.exists() {
            return Err(format!(
                "--draw {shown}: it is there: choose another file, or remove it first"
            ));
        }
        match out.parent() {
            Some(parent) if parent != Path::new("") && !parent.is_dir() => Err(format!(
                "--draw {shown}: there is no folder {}",
                parent.display()
            )),
            _ => Ok(Self::Video(out.to_owned())),
        }
    }

    /// Begins to write frames, the first of which is `first`: at their own times or, where they have none, at `rate`.
    pub fn open(&self, rate: Rate, first: &FrameFile) -> Result<Drawn, Box<dyn Error>> {
        match self {
            Self::Folder(folder) => Ok(Drawn::Folder(folder.clone())),
            Self::Video(path) => {
                let picture = drawn(&first.bytes, &[])?;
                let video = VideoFile::create(path, rate, first.time.is_some(), &picture);
                let video = video.map_err(|error| format!("--draw {error}"))?;
                Ok(Drawn::Video(video, first.time))
            }
        }
    }
}

impl Drawn {
    /// Adds a frame with the boxes of its targets.
    pub fn add(&mut self, frame: &FrameFile, estimates: &[Estimate]) -> Result<(), Box<dyn Error>> {
        let picture = drawn(&frame.bytes, estimates)?;
        match self {
            Self::Folder(folder) => {
                let name = frame.file.clone();
                let name = name.unwrap_or_else(|| format!("{:06}.jpg", frame.index));
                let mut file = folder.join(Path::new(&name).with_extension("jpg"));
                if file.exists() {
                    // The source has two files that differ only in their endings, like a.jpg and a.png.
                    file = folder.join(format!("{name}.jpg"));
                }
                fs::write(&file, picture)
                    .map_err(|error| format!("{}: {error}", file.display()))?;
            }
            Self::Video(video, first) => {
                // When tracking goes backwards, times decrease.
                let seconds = frame.time.zip(*first);
                let seconds = seconds.map_or(0.0, |(time, first)| (time - first).abs());
                video.add(&picture, seconds)?;
            }
        }
        Ok(())
    }

    /// Waits until all is written.
    pub fn finish(self) -> Result<(), String> {
        match self {
            Self::Folder(_) => Ok(()),
            Self::Video(video, _) => video.finish(),
        }
    }
}

/// The frame as JPEG, upright, with the boxes and scores.
fn drawn(bytes: &[u8], estimates: &[Estimate]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut picture = Picture::decode(bytes, &Limits::default(), u32::MAX)?;
    let targets = estimates.iter().enumerate();
    let targets = targets.map(|(number, estimate)| drawing::Drawn {
        number: (estimates.len() > 1).then_some(number),
        estimate,
        particles: &[],
    });
    drawing::draw(&mut picture, &targets.collect::<Vec<_>>());
    Ok(picture.jpeg()?)
}
