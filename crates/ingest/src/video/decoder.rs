//! A video being decoded: the process, and the threads that feed it and hear what it says.

use super::child;
use super::error::VideoError;
use super::parts;
use super::sniff::VideoFormat;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// The kinds of uploads that are read: MP4, Matroska and WebM, GIF, JPEG files in a row.
const FORMATS: &str = "mov,matroska,gif,mjpeg";
/// More pictures than any video has.
const MAX_PICTURES: usize = 1 << 30;
/// Most bytes of a line of what the program says.
const MAX_SAID: usize = 200;

/// What decoding a video may take.
#[derive(Debug, Clone, Copy)]
pub struct VideoLimits {
    /// Most pixels of a picture.
    pub max_pixels: u64,
    /// Most bytes of a picture.
    pub max_bytes: usize,
    /// Most pictures; one more tells that there are more.
    pub max_pictures: usize,
}

/// A video being decoded. The process ends when this is dropped.
#[derive(Debug)]
pub struct VideoDecoder {
    child: Arc<Mutex<Child>>,
    pictures: BufReader<ChildStdout>,
    said: Option<JoinHandle<String>>,
    limits: VideoLimits,
}

/// Ends the process from elsewhere.
#[derive(Debug)]
pub struct Stop(Arc<Mutex<Child>>);

impl Drop for Stop {
    fn drop(&mut self) {
        end(&self.0);
    }
}

impl VideoDecoder {
    /// Begins to decode these bytes with this program.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn of_bytes(
        program: &str,
        bytes: impl AsRef<[u8]> + Send + 'static,
        format: VideoFormat,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        // MP4 files may have their index at the end. The cache makes it possible to go back in a pipe.
        let mut input = vec!["-protocol_whitelist", "cache,pipe"];
        input.extend(["-format_whitelist", FORMATS]);
        match format {
            VideoFormat::Container => input.extend(["-i", "cache:pipe:0"]),
            VideoFormat::MotionJpeg => input.extend(["-f", "mjpeg", "-i", "pipe:0"]),
        }
        Self::start(program, &input, bytes, limits)
    }

    /// Begins to decode a file of this machine: from its first picture, or from the first one that is shown `from`
    /// seconds after the file's start time or later. A file without an index may begin later than that.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn of_file(
        program: &str,
        path: &Path,
        from: Option<f64>,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let url = format!("file:{}", path.display());
        let from = from.map(|seconds| format!("{seconds:.6}"));
        let mut input = vec!["-protocol_whitelist", "file"];
        if let Some(seconds) = &from {
            input.extend(["-ss", seconds]);
        }
        input.extend(["-i", &url]);
        Self::start(program, &input, [], limits)
    }

    fn start(
        program: &str,
        input: &[&str],
        bytes: impl AsRef<[u8]> + Send + 'static,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let pixels = limits.max_pixels.to_string();
        let count = limits.max_pictures.min(MAX_PICTURES) + 1;
        let count = count.to_string();
        let before = ["-hide_banner", "-nostdin", "-v", "error", "-threads", "1"];
        let limit = ["-max_pixels", &pixels];
        let chosen = [
            "-map",
            "0:v:0",
            "-vsync",
            "passthrough",
            "-frames:v",
            &count,
        ];
        // By default the encoder counts frames of a constant rate, and refuses two in the time of one.
        let times = ["-enc_time_base", "1:1000000"];
        let coded = [
            "-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p", "-threads", "1",
        ];
        let output = ["-f", "mpjpeg", "pipe:1"];
        let arguments = [&before[..], &limit, input, &chosen, &times, &coded, &output].concat();
        let mut child = child::start(program, arguments)?;
        let piped = "the command says that it is a pipe";
        let (mut stdin, stdout, stderr) = (
            child.stdin.take().expect(piped),
            child.stdout.take().expect(piped),
            child.stderr.take().expect(piped),
        );
        // Neither thread outlives the process. A program that has seen enough closes its input.
        thread::spawn(move || {
            let _ = stdin.write_all(bytes.as_ref());
        });
        let said = thread::spawn(move || last_line(BufReader::new(stderr)));
        Ok(Self {
            child: Arc::new(Mutex::new(child)),
            pictures: BufReader::new(stdout),
            said: Some(said),
            limits,
        })
    }

    /// What ends the process when it is dropped, also while another thread waits for a picture.
    pub fn stop(&self) -> Stop {
        Stop(self.child.clone())
    }

    /// The next picture, as a JPEG file; none after the last.
    ///
    /// # Errors
    /// The rest cannot be decoded.
    pub fn next_picture(&mut self) -> Result<Option<Vec<u8>>, VideoError> {
        let read = parts::next_part(&mut self.pictures, self.limits.max_bytes);
        if let Some(picture) = read.map_err(|error| VideoError::Damaged(error.to_string()))? {
            return Ok(Some(picture));
        }
        let Some(said) = self.said.take() else {
            return Ok(None);
        };
        let said = said.join().unwrap_or_default();
        let ended = lock(&self.child).wait();
        match ended {
            Ok(status) if status.success() => Ok(None),
            Ok(_) if !said.is_empty() => Err(VideoError::Damaged(said)),
            Ok(status) => Err(VideoError::Damaged(format!("the decoder ended ({status})"))),
            Err(error) => Err(VideoError::Damaged(error.to_string())),
        }
    }
}

impl Drop for VideoDecoder {
    fn drop(&mut self) {
        end(&self.child);
    }
}

fn lock(child: &Mutex<Child>) -> std::sync::MutexGuard<'_, Child> {
    // Nothing panics while it is held.
    child.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the process and waits for its end, so that it leaves nothing behind.
fn end(child: &Mutex<Child>) {
    let mut child = lock(child);
    let _ = child.kill();
    let _ = child.wait();
}

/// The last line that tells something. All is read, so that the program never waits.
fn last_line(mut said: impl BufRead) -> String {
    let mut last = String::new();
    let mut line = Vec::new();
    while said
        .read_until(b'\n', &mut line)
        .is_ok_and(|count| count > 0)
    {
        let text = String::from_utf8_lossy(&line);
        let text = text.trim();
        // The cache says on every start that it cannot know the length of a pipe.
        let is_noise = text.starts_with("[cache @") || text.contains("Last message repeated");
        if !is_noise && !text.is_empty() {
            last = text.chars().take(MAX_SAID).collect();
        }
        line.clear();
    }
    last
}
