//! A video that is written frame by frame, by an installed ffmpeg. ffmpeg gets JPEG pictures with their times as an IVF
//! file: a header of 32 bytes, and before each picture its length and its time.

use super::video_info::{FFMPEG, Rate};
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};

/// The endings of names of videos.
const ENDINGS: [&str; 7] = ["mp4", "m4v", "mov", "mkv", "webm", "avi", "gif"];
/// The usual encoders want even sides.
const EVEN: &str = "pad=ceil(iw/2)*2:ceil(ih/2)*2";
/// ffmpeg's filter that chooses the 256 colours of each frame of a GIF.
const PALETTE: &str = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1";

/// Ticks a second of frames' own times: MPEG's, of which frames at usual rates take a whole number.
const TICKS: u32 = 90_000;

/// Least time of a picture of a GIF, in ticks: players show one with less than two hundredths of a second for longer.
const LEAST_OF_GIF: u64 = TICKS as u64 / 50;

/// When the pictures of a video are shown.
#[derive(Debug, Clone, Copy)]
pub enum Timing {
    /// Each at its own time.
    Own,
    /// All at equal intervals, at this rate.
    Equal(Rate),
}

/// A video being encoded. Its last frames are written when it is [finished](Self::finish).
pub struct VideoFile {
    path: PathBuf,
    timing: Timing,
    /// The time of the next picture is at least this, in ticks.
    next: u64,
    encoder: Child,
    said: JoinHandle<String>,
}

/// The names of videos, for messages.
pub fn endings() -> String {
    ENDINGS.map(|ending| format!(".{ending}")).join(", ")
}

pub fn is_video(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_ascii_lowercase()
}

impl VideoFile {
    /// A new video of JPEG pictures like this one. First a trial tells whether this ffmpeg can write such a video
    /// there. Pictures of an AVI are shown equally long.
    ///
    /// # Errors
    /// ffmpeg cannot be started, or cannot write such a video there.
    pub fn create(
        path: &Path,
        rate: Rate,
        own_times: bool,
        picture: &[u8],
    ) -> Result<Self, String> {
        let timing = match own_times && ending(path) != "avi" {
            true => Timing::Own,
            false => Timing::Equal(rate),
        };
        let mut trial = Self::start(path, timing)?;
        let added = trial.add(picture, 0.0);
        // `finish` also tells why nothing could be added.
        let finished = trial.finish();
        let _ = fs::remove_file(path);
        finished.and(added)?;
        Self::start(path, timing)
    }

    fn start(path: &Path, timing: Timing) -> Result<Self, String> {
        let mut command = Command::new(FFMPEG);
        command.args(["-hide_banner", "-nostdin", "-v", "error", "-n"]);
        command.args(["-f", "ivf", "-i", "pipe:0"]);
        if let Timing::Own = timing {
            let ticks = format!("1:{TICKS}");
            command.args(["-vsync", "vfr", "-enc_time_base", &ticks]);
        }
        match ending(path).as_str() {
            "gif" => command.args(["-vf", PALETTE]),
            // Without a quality, the default encoder of AVI aims at 200 kbit/s.
            "avi" => command.args(["-vf", EVEN, "-pix_fmt", "yuv420p", "-q:v", "3"]),
            _ => command.args(["-vf", EVEN, "-pix_fmt", "yuv420p"]),
        };
        // An absolute path cannot be taken for a flag or a URL.
        let absolute = std::path::absolute(path);
        command.arg(absolute.map_err(|error| format!("{}: {error}", path.display()))?);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        // Ctrl-C goes to the whole group. The encoder has to go on, so that the file gets its end.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut encoder = command.spawn().map_err(|error| {
            format!(
                "{}: `{FFMPEG}` cannot be started: {error}; install ffmpeg",
                path.display()
            )
        })?;
        let mut stderr = encoder
            .stderr
            .take()
            .expect("the command says that it is a pipe");
        let said = thread::spawn(move || {
            let mut said = String::new();
            let _ = stderr.read_to_string(&mut said);
            said
        });
        let mut video = Self {
            path: path.to_owned(),
            timing,
            next: 0,
            encoder,
            said,
        };
        // If the encoder has ended already, adding the first picture fails.
        let _ = video.write(&header(timing));
        Ok(video)
    }

    /// Adds a picture, a JPEG file, which is shown `seconds` after the first one.
    ///
    /// # Errors
    /// The encoder has ended; [`Self::finish`] tells why.
    pub fn add(&mut self, picture: &[u8], seconds: f64) -> Result<(), String> {
        let ticks = match self.timing {
            Timing::Own => (seconds * f64::from(TICKS)).round() as u64,
            Timing::Equal(_) => self.next,
        };
        let is_gif = matches!(self.timing, Timing::Own) && ending(&self.path) == "gif";
        if is_gif && ticks < self.next {
            return Ok(());
        }
        let ticks = ticks.max(self.next);
        self.next = ticks + if is_gif { LEAST_OF_GIF } else { 1 };
        let length = u32::try_from(picture.len()).expect("a JPEG file of a frame is below 4 GiB");
        self.write(&length.to_le_bytes())?;
        self.write(&ticks.to_le_bytes())?;
        self.write(picture)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), String> {
        let pipe = self.encoder.stdin.as_mut();
        let pipe = pipe.expect("it is closed at the end only");
        let written = pipe.write_all(bytes);
        written.map_err(|error| format!("{}: {error}", self.path.display()))
    }

    /// Waits until all is written.
    ///
    /// # Errors
    /// The video could not be written; the text has the encoder's last message.
    pub fn finish(mut self) -> Result<(), String> {
        drop(self.encoder.stdin.take());
        let ended = self.encoder.wait();
        let said = self.said.join().unwrap_or_default();
        if ended.is_ok_and(|status| status.success()) {
            return Ok(());
        }
        let last = said.lines().rfind(|line| !line.trim().is_empty());
        Err(format!(
            "{}: this ffmpeg cannot write it: {}",
            self.path.display(),
            last.unwrap_or("it ended without a word")
        ))
    }
}

/// What an IVF file begins with. The pictures tell their size.
fn header(timing: Timing) -> Vec<u8> {
    let (ticks, seconds) = match timing {
        Timing::Own => (TICKS, 1),
        Timing::Equal(rate) => rate.parts(),
    };
    let mut header = b"DKIF\0\0\x20\0MJPG".to_vec();
    for field in [0, ticks, seconds, 0, 0] {
        header.extend(field.to_le_bytes());
    }
    header
}
