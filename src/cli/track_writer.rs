//! What `bagtrack track --draw` writes: a folder of pictures, or a video.

use super::draw;
use super::track_frames::{FFMPEG, FrameFile};
use bagtrack_cli::output;
use bagtrack_tracker::Estimate;
use std::error::Error;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The file names of videos end with these.
const VIDEOS: [&str; 4] = ["mp4", "webm", "mkv", "mov"];

/// Takes the drawn frames.
pub enum Writer {
    /// Writes pictures into a folder.
    Folder(PathBuf),
    /// Encodes a video.
    Video(Child),
}

impl Writer {
    /// A new folder or a new video with so many frames a second.
    pub fn open(out: &Path, rate: &str) -> Result<Self, Box<dyn Error>> {
        let extension = out.extension().and_then(|extension| extension.to_str());
        let extension = extension.unwrap_or("").to_ascii_lowercase();
        if !VIDEOS.contains(&extension.as_str()) {
            output::new_folder(out)?;
            return Ok(Self::Folder(out.to_owned()));
        }
        if out.exists() {
            let shown = out.display();
            return Err(
                format!("{shown} is there: choose another file, or remove it first").into(),
            );
        }
        let mut command = Command::new(FFMPEG);
        command.args(["-hide_banner", "-nostdin", "-v", "error", "-n"]);
        command.args(["-f", "mjpeg", "-framerate", rate, "-i", "pipe:0"]);
        // The usual encoders want even sides.
        command.args([
            "-vf",
            "pad=ceil(iw/2)*2:ceil(ih/2)*2",
            "-pix_fmt",
            "yuv420p",
        ]);
        command.arg(std::path::absolute(out)?);
        command.stdin(Stdio::piped()).stderr(Stdio::piped());
        let child = command.stdout(Stdio::null()).spawn();
        let child = child
            .map_err(|error| format!("`{FFMPEG}` cannot be started: {error}; install ffmpeg"))?;
        Ok(Self::Video(child))
    }

    /// Adds a frame with its box.
    pub fn add(&mut self, frame: &FrameFile, estimate: &Estimate) -> Result<(), Box<dyn Error>> {
        let drawn = draw::with_box(&frame.bytes, estimate)?;
        match self {
            Self::Folder(folder) => {
                let name = frame.file.clone();
                let name = name.unwrap_or_else(|| format!("{:06}.jpg", estimate.frame));
                let file = folder.join(Path::new(&name).with_extension("jpg"));
                fs::write(&file, drawn).map_err(|error| format!("{}: {error}", file.display()))?;
            }
            Self::Video(child) => {
                let pipe = child.stdin.as_mut().expect("it is closed at the end only");
                if pipe.write_all(&drawn).is_err() {
                    return Err(said(child).into());
                }
            }
        }
        Ok(())
    }

    /// Waits until all is written.
    pub fn finish(self) -> Result<(), Box<dyn Error>> {
        let Self::Video(mut child) = self else {
            return Ok(());
        };
        drop(child.stdin.take());
        match child.wait()?.success() {
            true => Ok(()),
            false => Err(said(&mut child).into()),
        }
    }
}

/// What an encoder that failed said last.
fn said(child: &mut Child) -> String {
    let mut text = String::new();
    if let Some(said) = &mut child.stderr {
        let _ = said.read_to_string(&mut text);
    }
    let last = text.lines().rfind(|line| !line.trim().is_empty());
    format!(
        "the video cannot be written: {}",
        last.unwrap_or("ffmpeg ended")
    )
}
