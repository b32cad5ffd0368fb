//! A video being decoded: the process, and the threads that feed it and hear what it says.

use super::child::{self, Launcher};
use super::error::{Cost, VideoError};
use super::output::{self, VideoPicture};
use super::said::{Fault, Said};
use super::sniff::VideoFormat;
use std::io::{self, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// The kinds of uploads that are read: MP4, Matroska and WebM, GIF, JPEG files in a row.
const FORMATS: &str = "mov,matroska,gif,mjpeg";
/// The codecs of these, by the names of their decoders.
const CODECS: &str = "h264,hevc,vp8,vp9,av1,libdav1d,libaom-av1,mpeg4,h263,mjpeg,gif";
/// The file without a name that is the program's input, which it can go back in.
const NAMELESS: &str = "file:/proc/self/fd/0";
/// More pictures than any video has.
const MAX_PICTURES: usize = 1 << 30;
/// The system's signals for a process that has had its processor time: SIGKILL, SIGXCPU.
#[cfg(unix)]
const OUT_OF_TIME: [i32; 2] = [9, 24];

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
    said: Said,
    hearing: Option<JoinHandle<()>>,
    limits: VideoLimits,
    program: String,
    given: usize,
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
    /// Begins to decode these bytes with this program, which `launcher` starts where it has any words. It may take as long as
    /// copying the bytes.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn of_bytes(
        launcher: &Launcher,
        program: &str,
        bytes: impl AsRef<[u8]> + Send + 'static,
        format: VideoFormat,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let is_container = format == VideoFormat::Container;
        let file = match launcher.hides_files && is_container {
            true => child::nameless(bytes.as_ref()),
            false => None,
        };
        // MP4 files may have their index at the end. Without a file the cache makes it possible to go back in a pipe.
        let (protocols, source) = match (is_container, &file) {
            (false, _) => ("pipe", &["-f", "mjpeg", "-i", "pipe:0"][..]),
            (true, Some(_)) => ("file", &["-i", NAMELESS][..]),
            (true, None) => ("cache,pipe", &["-i", "cache:pipe:0"][..]),
        };
        let mut input = vec!["-protocol_whitelist", protocols];
        input.extend(["-format_whitelist", FORMATS, "-codec_whitelist", CODECS]);
        input.extend(source);
        let decoder = (launcher, program);
        match file {
            Some(file) => Self::start(decoder, &input, file, limits),
            None => Self::start_fed(decoder, &input, bytes, limits),
        }
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
        let decoder = (&Launcher::default(), program);
        Self::start(decoder, &input, Stdio::null(), limits)
    }

    /// Starts the program with a pipe that these bytes come through.
    fn start_fed(
        decoder: (&Launcher, &str),
        input: &[&str],
        bytes: impl AsRef<[u8]> + Send + 'static,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let decoder = Self::start(decoder, input, Stdio::piped(), limits)?;
        let stdin = lock(&decoder.child).stdin.take();
        let mut stdin = stdin.expect("the command says that it is a pipe");
        // It does not outlive the process. A program that has seen enough closes its input.
        thread::spawn(move || {
            let _ = stdin.write_all(bytes.as_ref());
        });
        Ok(decoder)
    }

    fn start(
        (launcher, program): (&Launcher, &str),
        input: &[&str],
        stdin: Stdio,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let pixels = limits.max_pixels.to_string();
        let count = limits.max_pictures.min(MAX_PICTURES) + 1;
        let count = count.to_string();
        let before = ["-hide_banner", "-nostdin", "-v", "error", "-threads", "1"];
        // It ends at damage, in place of leaving pictures out.
        let strict = ["-xerror", "-err_detect", "explode"];
        let limit = ["-max_pixels", &pixels];
        let chosen = [
            "-map",
            "0:v:0",
            "-vsync",
            "passthrough",
            "-frames:v",
            &count,
        ];
        let coded = [
            "-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p", "-threads", "1",
        ];
        let arguments = [
            &before[..],
            &strict,
            &limit,
            input,
            &chosen,
            // By default the encoder counts frames of a constant rate, and refuses two in the time of one.
            &output::TIME_BASE,
            &coded,
            &output::FORMAT,
        ]
        .concat();
        let mut child = child::start(launcher, program, arguments, stdin)?;
        let piped = "the command says that it is a pipe";
        let (stdout, stderr) = (
            child.stdout.take().expect(piped),
            child.stderr.take().expect(piped),
        );
        // The thread does not outlive the process.
        let said = Said::default();
        let heard = said.clone();
        let hearing = thread::spawn(move || heard.hear(BufReader::new(stderr)));
        Ok(Self {
            child: Arc::new(Mutex::new(child)),
            pictures: BufReader::new(stdout),
            said,
            hearing: Some(hearing),
            limits,
            program: program.to_owned(),
            given: 0,
        })
    }

    /// What ends the process when it is dropped, also while another thread waits for a picture.
    pub fn stop(&self) -> Stop {
        Stop(self.child.clone())
    }

    /// The next picture; none after the last.
    ///
    /// # Errors
    /// The rest cannot be decoded.
    pub fn next_picture(&mut self) -> Result<Option<VideoPicture>, VideoError> {
        let read = output::next_picture(&mut self.pictures, self.limits.max_bytes);
        let picture = read.map_err(|error| self.damaged(error.to_string()))?;
        if picture.is_none() {
            return self.end();
        }
        // Pictures after damage have unknown numbers.
        if let Some(fault) = self.said.fault() {
            return Err(self.error(fault));
        }
        self.given += 1;
        Ok(picture)
    }

    /// Whether the pictures that were given are all.
    fn end(&mut self) -> Result<Option<VideoPicture>, VideoError> {
        let Some(hearing) = self.hearing.take() else {
            return Ok(None);
        };
        let _ = hearing.join();
        let ended = lock(&self.child).wait();
        if let Some(fault) = self.said.fault() {
            return Err(self.error(fault));
        }
        match ended {
            Ok(status) if status.success() => Ok(None),
            Ok(status) if status.code() == Some(child::NOT_STARTED) => Err(VideoError::NoProgram {
                program: self.program.clone(),
                source: io::ErrorKind::NotFound.into(),
            }),
            Ok(_) if self.said.ends_with_unread_codec() => Err(VideoError::UnreadCodec),
            Ok(status) if is_out_of_time(status) => Err(VideoError::TooCostly(Cost::Time)),
            Ok(status) => Err(self.damaged(format!("the decoder ended ({status})"))),
            Err(error) => Err(self.damaged(error.to_string())),
        }
    }

    fn error(&self, fault: Fault) -> VideoError {
        match fault {
            Fault::NoPictures => VideoError::NoPictures,
            Fault::UnreadCodec => VideoError::UnreadCodec,
            Fault::Memory => VideoError::TooCostly(Cost::Memory),
            Fault::Pixels => VideoError::TooCostly(Cost::Pixels(self.limits.max_pixels)),
            Fault::Damage(reason) => self.damaged(reason),
        }
    }

    fn damaged(&self, reason: String) -> VideoError {
        let picture = self.given + 1;
        VideoError::Damaged { picture, reason }
    }
}

/// Whether the system ended it, as it does after its processor time.
#[cfg(unix)]
fn is_out_of_time(status: ExitStatus) -> bool {
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    signal.is_some_and(|signal| OUT_OF_TIME.contains(&signal))
}

/// Elsewhere its time is not limited.
#[cfg(not(unix))]
fn is_out_of_time(_status: ExitStatus) -> bool {
    false
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

/// The pictures, and the damage, that a program tells which writes and says these bytes; so that fuzzing needs no program.
///
/// # Errors
/// What is written cannot be read.
#[cfg(fuzzing)]
pub fn read_output(
    written: &[u8],
    said: &[u8],
    max_bytes: usize,
) -> io::Result<(Vec<VideoPicture>, Option<String>)> {
    let heard = Said::default();
    heard.hear(said);
    let mut stream = written;
    let pictures = std::iter::from_fn(|| output::next_picture(&mut stream, max_bytes).transpose());
    Ok((pictures.collect::<io::Result<_>>()?, heard.damage()))
}
