//! A video being decoded: the process, and the threads that write its input and read its standard error.

use super::child::{self, Launcher, Started, Trust};
use super::error::{Cost, VideoError};
use super::output::{self, VideoPicture};
use super::said::{Fault, Said};
use super::sniff::VideoFormat;
use bytes::Bytes;
use std::ffi::{OsStr, OsString};
use std::io::{self, BufReader, PipeWriter, Write};
use std::mem;
use std::ops::Range;
use std::path::Path;
use std::process::{Child, ChildStdout, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// The kinds of uploads that are read: MP4, Matroska and WebM, GIF, JPEG files in a row.
const FORMATS: &str = "mov,matroska,gif,mjpeg";
/// The codecs of these, by the names of their decoders.
const CODECS: &str = "h264,hevc,vp8,vp9,av1,libdav1d,libaom-av1,mpeg4,h263,mjpeg,gif";
/// The program's input as a file without a name, in which it can seek back.
const NAMELESS: &str = "file:/proc/self/fd/0";
/// The program counts the pixels of a picture with a width that is rounded up to 64. The limit is raised by as much as
/// that adds for a height of 8192. The decoder of the JPEG file compares the picture's own size with the limit.
const PADDING: u64 = 63 * 8192;
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
    /// Most pictures that are wanted; the decoder gives one more if there are more.
    pub max_pictures: usize,
}

/// What is decoded.
#[derive(Debug, Clone)]
enum Source {
    /// Bytes of an upload, with the launcher of the program and the video's format.
    Bytes(Launcher, Bytes, VideoFormat),
    /// The URL of a file of this machine, and where to begin: at a picture that is shown within these seconds after the
    /// file's start time.
    File(OsString, Option<Range<f64>>),
}

/// What the program is to treat as damage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Strictness {
    /// All damage that it finds: it ends there, and leaves no pictures out.
    All,
    /// All but missing reference pictures, as at the start of a video that was cut where pictures need others before
    /// the cut. The program leaves out the pictures that it cannot decode.
    AllButReferences,
}

/// A video being decoded. The process ends when this is dropped.
#[derive(Debug)]
pub struct VideoDecoder {
    /// The source, with which it can begin anew until the first picture is there.
    source: Option<Source>,
    limits: VideoLimits,
    program: String,
    strictness: Strictness,
    running: Arc<Mutex<Running>>,
    pictures: BufReader<ChildStdout>,
    said: Said,
    /// The writing end of the program's standard error, until the first picture is there.
    saying: Option<PipeWriter>,
    hearing: Option<JoinHandle<()>>,
    /// Pictures that are shown before this are passed over, in seconds after the file's start time.
    from: Option<f64>,
    /// Pictures that were read, those that were passed over too.
    read: usize,
}

/// The process, which may be replaced by another one.
#[derive(Debug)]
struct Running {
    child: Child,
    /// Whether a process that replaces this one has to end, too.
    is_stopped: bool,
}

/// Ends the process from elsewhere.
#[derive(Debug)]
pub struct Stop(Arc<Mutex<Running>>);

impl Drop for Stop {
    fn drop(&mut self) {
        let mut running = lock(&self.0);
        running.is_stopped = true;
        end(&mut running.child);
    }
}

impl VideoDecoder {
    /// Begins to decode these bytes with this program, which `launcher` starts where it has any words. May block for as
    /// long as it takes to copy the bytes.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn of_bytes(
        launcher: &Launcher,
        program: &str,
        bytes: Bytes,
        format: VideoFormat,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let source = Source::Bytes(launcher.clone(), bytes, format);
        Self::start(source, program, limits, Strictness::All)
    }

    /// Begins to decode a file of this machine: from its first picture, or from the first one that is shown within
    /// these seconds after the file's start time. A file without an index may begin later than that.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn of_file(
        program: &str,
        path: &Path,
        from: Option<Range<f64>>,
        limits: VideoLimits,
    ) -> Result<Self, VideoError> {
        let mut url = OsString::from("file:");
        url.push(path);
        let source = Source::File(url, from);
        Self::start(source, program, limits, Strictness::All)
    }

    fn start(
        source: Source,
        program: &str,
        limits: VideoLimits,
        strictness: Strictness,
    ) -> Result<Self, VideoError> {
        let Started {
            mut child,
            said: pipe,
            saying,
        } = source.start(program, limits, strictness)?;
        let stdout = child.stdout.take();
        let stdout = stdout.expect("the command says that it is a pipe");
        // The thread ends once the process has ended and, before the first picture, `saying` is dropped.
        let said = Said::new(strictness == Strictness::AllButReferences);
        let heard = said.clone();
        let hearing = thread::spawn(move || heard.hear(BufReader::new(pipe)));
        Ok(Self {
            source: Some(source),
            limits,
            program: program.to_owned(),
            strictness,
            running: Arc::new(Mutex::new(Running {
                child,
                is_stopped: false,
            })),
            pictures: BufReader::new(stdout),
            said,
            saying: Some(saying),
            hearing: Some(hearing),
            from: None,
            read: 0,
        })
    }

    /// Begins anew with this source, where the first pictures could not be decoded. Each [`Stop`] stops the new
    /// process, too.
    fn start_again(&mut self, source: Source) -> Result<(), VideoError> {
        end(&mut lock(&self.running).child);
        let (source, strictness, from) = match source {
            // These pictures are wanted. Decoded from the file's beginning, all can be made.
            Source::File(url, Some(from)) => {
                let whole = Source::File(url, None);
                (whole, Strictness::All, Some(from.start))
            }
            source => (source, Strictness::AllButReferences, self.from),
        };
        let mut again = Self::start(source, &self.program, self.limits, strictness)?;
        again.from = from;
        let mut running = lock(&self.running);
        mem::swap(&mut running.child, &mut lock(&again.running).child);
        if running.is_stopped {
            // It was stopped while the new process was started.
            end(&mut running.child);
        }
        drop(running);
        mem::swap(self, &mut again);
        mem::swap(&mut self.running, &mut again.running);
        Ok(())
    }

    /// A handle that ends the process when it is dropped, even while another thread waits for a picture.
    pub fn stop(&self) -> Stop {
        Stop(self.running.clone())
    }

    /// The next picture; `None` after the last.
    ///
    /// # Errors
    /// The rest cannot be decoded.
    pub fn next_picture(&mut self) -> Result<Option<VideoPicture>, VideoError> {
        loop {
            let picture = self.read_picture();
            if let Some(source) = self.source.take()
                && self.misses_first(&source, &picture)
            {
                self.start_again(source)?;
                continue;
            }
            match (picture?, self.from) {
                (Some(picture), Some(from)) if picture.time < from => {}
                (Some(VideoPicture { jpeg, time }), Some(from)) => {
                    let time = time - from;
                    return Ok(Some(VideoPicture { jpeg, time }));
                }
                (picture, _) => return Ok(picture),
            }
        }
    }

    /// Whether the first pictures could not be decoded for want of a reference picture, and beginning anew helps.
    /// Decoders of H.264 report the missing reference; those of H.265 skip the pictures silently.
    fn misses_first(
        &self,
        source: &Source,
        picture: &Result<Option<VideoPicture>, VideoError>,
    ) -> bool {
        match (source, picture) {
            (Source::File(_, Some(range)), Ok(Some(picture))) => {
                picture.time >= range.end - range.start
            }
            // No picture came: the last ones of the file may need references before the start.
            (Source::File(_, Some(_)), Ok(None)) => true,
            (_, Ok(_)) => false,
            (_, Err(_)) => {
                let is_strict = self.strictness == Strictness::All;
                is_strict && self.said.fault() == Some(Fault::Reference)
            }
        }
    }

    fn read_picture(&mut self) -> Result<Option<VideoPicture>, VideoError> {
        let read = output::next_picture(&mut self.pictures, self.limits.max_bytes);
        let picture = read.map_err(|error| self.damaged(error.to_string()))?;
        let saying = self.saying.take();
        if picture.is_none() {
            drop(saying);
            return self.end();
        }
        // Messages before the first picture tell whether to begin anew, which is too late after the second one.
        if let Some(saying) = saying {
            self.said.catch_up(saying);
        }
        // Where the program goes on after damage, the numbers of its pictures are unknown.
        if let Some(fault) = self.said.fault() {
            return Err(self.error(fault));
        }
        self.read += 1;
        Ok(picture)
    }

    /// After the last picture: an error unless the video was decoded to its end.
    fn end(&mut self) -> Result<Option<VideoPicture>, VideoError> {
        let Some(hearing) = self.hearing.take() else {
            return Ok(None);
        };
        let _ = hearing.join();
        let ended = lock(&self.running).child.wait();
        if let Some(fault) = self.said.fault_in_all() {
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
            Fault::Reference => {
                self.damaged("a picture that others are made from is missing".to_owned())
            }
            Fault::Damage(reason) => self.damaged(reason),
        }
    }

    fn damaged(&self, reason: String) -> VideoError {
        let picture = self.read + 1;
        VideoError::Damaged { picture, reason }
    }
}

impl Source {
    /// Starts the program, and a thread that writes its input where that is a pipe.
    fn start(
        &self,
        program: &str,
        limits: VideoLimits,
        strictness: Strictness,
    ) -> Result<Started, VideoError> {
        let begin = |launcher: &Launcher, input: &[&OsStr], stdin: Stdio| {
            let arguments = arguments(input, limits, strictness);
            let trust = match self {
                Self::Bytes(..) => Trust::Foreign,
                Self::File(..) => Trust::Own,
            };
            child::start(launcher, program, arguments, stdin, trust)
        };
        let (launcher, bytes, format) = match self {
            Self::Bytes(launcher, bytes, format) => (launcher, bytes, *format),
            Self::File(url, from) => {
                let from = from.as_ref().map(|range| format!("{:.6}", range.start));
                let mut input = vec!["-protocol_whitelist", "file"];
                if let Some(seconds) = &from {
                    input.extend(["-ss", seconds]);
                }
                input.push("-i");
                let mut input: Vec<&OsStr> = input.into_iter().map(OsStr::new).collect();
                input.push(url);
                return begin(&Launcher::default(), &input, Stdio::null());
            }
        };
        let is_container = format == VideoFormat::Container;
        let file = match launcher.hides_files && is_container {
            true => child::nameless(bytes),
            false => None,
        };
        // MP4 files may have their index at the end. With a pipe, ffmpeg's protocol `cache` makes it possible to seek
        // back.
        let (protocols, source) = match (is_container, &file) {
            (false, _) => ("pipe", &["-f", "mjpeg", "-i", "pipe:0"][..]),
            (true, Some(_)) => ("file", &["-i", NAMELESS][..]),
            (true, None) => (
                "cache,pipe",
                &["-read_ahead_limit", "-1", "-i", "cache:pipe:0"][..],
            ),
        };
        let mut input = vec!["-protocol_whitelist", protocols];
        input.extend(["-format_whitelist", FORMATS, "-codec_whitelist", CODECS]);
        input.extend(source);
        let input: Vec<&OsStr> = input.into_iter().map(OsStr::new).collect();
        if let Some(file) = file {
            return begin(launcher, &input, file);
        }
        let mut started = begin(launcher, &input, Stdio::piped())?;
        let stdin = started.child.stdin.take();
        let mut stdin = stdin.expect("the command says that it is a pipe");
        let bytes = bytes.clone();
        // The thread does not outlive the process. A program that has read enough closes its input.
        thread::spawn(move || {
            let _ = stdin.write_all(&bytes);
        });
        Ok(started)
    }
}

/// The program's arguments for this input.
fn arguments(input: &[&OsStr], limits: VideoLimits, strictness: Strictness) -> Vec<OsString> {
    let pixels = limits.max_pixels.saturating_add(PADDING).to_string();
    let count = (limits.max_pictures.min(MAX_PICTURES) + 1).to_string();
    let before = ["-hide_banner", "-nostdin", "-v", "error", "-threads", "1"];
    let detection = match strictness {
        Strictness::All => &["-xerror", "-err_detect", "explode"][..],
        Strictness::AllButReferences => &["-xerror"],
    };
    // `V` leaves out cover pictures, which may come before the first track.
    let chosen = [
        "-map",
        "0:V:0",
        "-vsync",
        "passthrough",
        "-frames:v",
        &count,
    ];
    // The encoder refuses two pictures with the same time. The colours of a JPEG file are those of BT.601 in full
    // range.
    let filters = "setpts='if(isnan(PREV_OUTPTS),PTS,max(PTS,PREV_OUTPTS+1))',scale=out_color_matrix=bt601:out_range=full";
    let coded = [
        "-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p", "-threads", "1",
    ];
    let options = [&before[..], detection, &["-max_pixels", &pixels]].concat();
    let output = [
        &chosen[..],
        &["-vf", filters],
        // By default the encoder counts frames of a constant rate.
        &output::TIME_BASE,
        &coded,
        &output::FORMAT,
    ];
    let options = options.into_iter().map(OsString::from);
    let output = output.concat().into_iter().map(OsString::from);
    let input = input.iter().map(OsString::from);
    options.chain(input).chain(output).collect()
}

/// Whether one of the signals for used-up processor time ended the process.
#[cfg(unix)]
fn is_out_of_time(status: ExitStatus) -> bool {
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    signal.is_some_and(|signal| OUT_OF_TIME.contains(&signal))
}

/// On other systems its time is not limited.
#[cfg(not(unix))]
fn is_out_of_time(_status: ExitStatus) -> bool {
    false
}

impl Drop for VideoDecoder {
    fn drop(&mut self) {
        end(&mut lock(&self.running).child);
    }
}

fn lock(running: &Mutex<Running>) -> std::sync::MutexGuard<'_, Running> {
    // Nothing panics while the lock is held.
    running.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the process and waits for its end, so that it leaves nothing behind.
fn end(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// The pictures and the damage of a program whose output is `written` and whose standard error is `said`. Fuzzing calls
/// this, so that it needs no program.
///
/// # Errors
/// The output cannot be read.
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
