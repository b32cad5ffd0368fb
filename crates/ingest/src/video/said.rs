//! The messages of the decoder's program on its standard error, and the fault that they tell.

use std::io::{BufRead, Read, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Most characters of a line that an error repeats.
const MAX_SAID: usize = 200;
/// Most bytes of a line that are held; the rest counts as a line of its own.
const MAX_LINE: u64 = 4096;

/// [`Said::catch_up`] writes this byte behind all messages so far, and waits until it is read. No message contains it.
const MARK: u8 = 0;

/// What is wrong with a video.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    /// The file has no stream of pictures.
    NoPictures,
    /// The codec is not among those that may be read.
    UnreadCodec,
    /// There is too little memory.
    Memory,
    /// A picture has too many pixels.
    Pixels,
    /// A picture that others are made from is missing.
    Reference,
    /// Something else, with the program's message.
    Damage(String),
}

/// What is known from the program's messages. Clones share it.
#[derive(Debug, Clone, Default)]
pub(super) struct Said(Arc<(Mutex<Heard>, Condvar)>);

#[derive(Debug, Default)]
struct Heard {
    /// Whether the program leaves out pictures that it cannot decode, instead of ending there.
    leaves_out: bool,
    /// The fault of the first line that says more than that something failed.
    fault: Option<Fault>,
    /// A fault that counts only at the end of the video.
    fault_at_end: Option<Fault>,
    /// Whether `fault_at_end` is damage, at which the program should end.
    is_damaged: bool,
    /// Whether the last line was of a codec that may not be read.
    is_unlisted: bool,
    /// Whether the mark was heard, or the program says nothing more.
    is_caught_up: bool,
}

impl Said {
    /// No messages yet. `leaves_out`: the program leaves out pictures whose references are missing; otherwise it ends
    /// there.
    pub(super) fn new(leaves_out: bool) -> Self {
        let heard = Heard {
            leaves_out,
            ..Heard::default()
        };
        Self(Arc::new((Mutex::new(heard), Condvar::new())))
    }

    fn lock(&self) -> MutexGuard<'_, Heard> {
        // Nothing panics while the lock is held.
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until all messages so far in this pipe are read. Pictures come through another pipe, and on a busy machine
    /// a picture may arrive before earlier messages.
    pub(super) fn catch_up(&self, mut pipe: impl Write) {
        if pipe.write_all(&[MARK, b'\n']).is_ok() {
            drop(pipe);
            let caught_up = self
                .0
                .1
                .wait_while(self.lock(), |heard| !heard.is_caught_up);
            drop(caught_up);
        }
    }

    fn note_caught_up(&self) {
        self.lock().is_caught_up = true;
        self.0.1.notify_all();
    }

    /// What is wrong with the pictures from here on, as far as messages have told it.
    pub(super) fn fault(&self) -> Option<Fault> {
        self.lock().fault.clone()
    }

    /// What is wrong with the video, once the program has ended.
    pub(super) fn fault_in_all(&self) -> Option<Fault> {
        let heard = self.lock();
        heard.fault.clone().or_else(|| heard.fault_at_end.clone())
    }

    /// Whether the last line was of a codec that may not be read.
    pub(super) fn ends_with_unread_codec(&self) -> bool {
        self.lock().is_unlisted
    }

    /// The message of damage.
    #[cfg(fuzzing)]
    pub(super) fn damage(&self) -> Option<String> {
        match self.fault_in_all() {
            Some(Fault::Damage(text)) => Some(text),
            _ => None,
        }
    }

    /// Reads all messages, so that the program never blocks. Holds at most some kilobytes of them.
    pub(super) fn hear(&self, mut said: impl BufRead) {
        let mut line = Vec::new();
        while said
            .by_ref()
            .take(MAX_LINE)
            .read_until(b'\n', &mut line)
            .is_ok_and(|count| count > 0)
        {
            // The program may be within a line: the rest of it comes behind the mark.
            if let Some(end) = line.iter().position(|&byte| byte == MARK) {
                line.truncate(end);
                self.note_caught_up();
                if end < MAX_LINE as usize {
                    continue;
                }
            }
            self.lock().take(String::from_utf8_lossy(&line).trim());
            line.clear();
        }
        self.lock().take(String::from_utf8_lossy(&line).trim());
        self.note_caught_up();
    }
}

impl Heard {
    fn take(&mut self, line: &str) {
        // The cache says on every start that it cannot know the length of a pipe. Decoders skip a camera's note that is
        // no valid Exif.
        let noise = [
            "Last message repeated",
            "invalid TIFF header in EXIF data",
            "error decoding EXIF data",
        ];
        let is_noise = noise.iter().any(|text| line.contains(text));
        if is_noise || line.starts_with("[cache @") || line.is_empty() || is_of_sound(line) {
            return;
        }
        // ffmpeg says this when it reads the index. The pictures that exist still have right numbers.
        if line.contains("File ended prematurely") {
            self.fault_at_end.get_or_insert_with(|| fault(line, false));
            return;
        }
        // Sound is not decoded, and its codecs are not read either.
        let was_unlisted = std::mem::take(&mut self.is_unlisted);
        if line.contains("not on whitelist") {
            self.is_unlisted = true;
            return;
        }
        if self.leaves_out && is_reference(line) {
            return;
        }
        match (&self.fault, fault(line, was_unlisted)) {
            // The message about memory may come after that of the failure.
            (Some(Fault::Damage(_)), _) if is_memory(line) => self.fault = Some(Fault::Memory),
            (Some(_), _) => {}
            // This message follows from the damage.
            (None, _) if self.is_damaged && !is_memory(line) => {}
            // ffmpeg finds such damage ahead of the pictures. Pictures before it have right numbers.
            (None, found @ Fault::Damage(_)) if !self.leaves_out && !goes_on_after(line) => {
                self.fault_at_end = Some(found);
                self.is_damaged = true;
            }
            (None, found) => self.fault = Some(found),
        }
    }
}

/// Whether the program may go on after such a line although it is to end at all damage: these demuxers look for the
/// next whole piece.
fn goes_on_after(line: &str) -> bool {
    line.starts_with("[matroska") || line.starts_with("[gif")
}

/// Whether a line is of a codec of sound, which is probed and not decoded.
fn is_of_sound(line: &str) -> bool {
    let codec = line
        .strip_prefix('[')
        .and_then(|rest| rest.split_once(" @ "));
    let codecs = [
        "aac", "aac_latm", "ac3", "eac3", "mp2", "mp3", "dca", "flac", "opus", "vorbis", "alac",
    ];
    codec.is_some_and(|(name, _)| codecs.contains(&name.trim_end_matches("float")))
}

/// Whether a line says that memory cannot be allocated, in words or by the system's error number (ENOMEM, 12).
fn is_memory(line: &str) -> bool {
    line.contains("allocat") || line.contains("(-12 ")
}

/// Whether a line says that a reference picture is missing, or is one of those that come before the first reference
/// picture, as at the start of a recording that begins between two of them.
fn is_reference(line: &str) -> bool {
    let says = [
        // Messages of H.264 and H.265.
        "eference picture",
        "mmco: ",
        "co located POCs",
        "find ref with POC",
        // Messages of H.264, and those that follow from them.
        "non-existing PPS",
        "non-existing SPS",
        "decode_slice_header error",
        "no frame!",
        // Messages of H.265, and of MPEG-2.
        "PPS id out of range",
        "Invalid frame dimensions 0x0",
    ];
    says.iter().any(|text| line.contains(text))
}

/// The fault that a line tells. `was_unlisted`: the line before named a codec that may not be read.
fn fault(line: &str, was_unlisted: bool) -> Fault {
    let says = |text: &str| line.contains(text);
    // Components of ffmpeg put their names and addresses before their messages.
    let mut text = line;
    while text.starts_with('[')
        && let Some((_, rest)) = text.split_once("] ")
    {
        text = rest;
    }
    if says("matches no streams") {
        Fault::NoPictures
    } else if says("exceeds specified max pixel count") {
        Fault::Pixels
    } else if is_memory(line) || says("get_buffer() failed") {
        // Where no earlier line says what is wrong with the picture.
        Fault::Memory
    } else if was_unlisted && says("while opening decoder")
        // For a codec that ffmpeg does not know at all: its words before version 6.1, and since.
        || says("not found for input stream")
        || says("no decoder found for")
    {
        Fault::UnreadCodec
    } else if is_reference(line) {
        Fault::Reference
    } else if says("moov atom not found") {
        Fault::Damage("its index is missing, as in a file that was cut off".to_owned())
    } else {
        let text = text.trim_matches(|sign: char| sign.is_whitespace() || sign == '.');
        Fault::Damage(text.chars().take(MAX_SAID).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{self, BufReader};
    use std::thread;

    /// If a whole line were held, it could take as many bytes as the program has time to write.
    #[test]
    fn of_a_line_without_an_end_little_is_held() {
        let said = Said::default();
        let endless = BufReader::new(io::repeat(b'x').take(64 << 20));
        let used = allocation_counter::measure(|| said.hear(endless));
        assert!(used.bytes_max < 64 << 10, "{used:?}");
        let told = Some(Fault::Damage("x".repeat(MAX_SAID)));
        assert_eq!(said.fault_in_all(), told);
    }

    /// On a busy machine a first picture may arrive before messages about pictures before it.
    #[test]
    fn what_was_said_is_heard_before_a_picture_is_given() {
        let (reference, sound) = (
            "[h264 @ 0x1] Missing reference picture, default is 65596\n",
            "[aac @ 0x1] channel element 3.4 is not allocated\n",
        );
        for (before, after, expected) in [
            (reference, "", Some(Fault::Reference)),
            // The mark comes within a line of the program.
            (&sound[..12], &sound[12..], None),
        ] {
            let said = Said::default();
            let (pipe, mut saying) = io::pipe().unwrap();
            saying.write_all(before.as_bytes()).unwrap();
            let mut program = saying.try_clone().unwrap();
            let heard = said.clone();
            let hearing = thread::spawn(move || heard.hear(BufReader::new(pipe)));
            said.catch_up(saying);
            assert_eq!(said.fault(), expected);
            program.write_all(after.as_bytes()).unwrap();
            drop(program);
            hearing.join().unwrap();
            assert_eq!(said.fault_in_all(), expected);
        }
    }

    #[test]
    fn the_first_line_is_told_but_for_memory() {
        let fault = |lines: &[&str]| {
            let said = Said::default();
            said.hear(lines.join("\n").as_bytes());
            said.fault_in_all()
        };
        let unlisted = "[prores @ 0x1] Codec (prores) not on whitelist 'h264'";
        let damage = |text: &str| Some(Fault::Damage(text.to_owned()));
        assert_eq!(
            fault(&[unlisted, "    Last message repeated 1 times"]),
            None
        );
        let lines = ["[h264 @ 0x1] Invalid NAL unit size", "Error while decoding"];
        assert_eq!(fault(&lines), damage("Invalid NAL unit size"));
        let sound = [
            "[aac @ 0x1] channel element 2.2 is not allocated",
            "[mp3float @ 0x1] Header missing",
        ];
        assert_eq!(fault(&sound), None);
        let note = "[mjpeg @ 0x1] mjpeg: invalid TIFF header in EXIF data";
        assert_eq!(fault(&[note]), None);
        // The length of a segment is wrong: a thumbnail within it may be taken for the picture.
        let segment = "[mjpeg @ 0x1] unable to decode APP fields: Invalid data";
        assert_eq!(
            fault(&[segment]),
            damage("unable to decode APP fields: Invalid data")
        );
        let failed = "[mjpeg @ 0x1] get_buffer() failed";
        assert_eq!(fault(&[failed]), Some(Fault::Memory));
        let size = "[h264 @ 0x1] [IMGUTILS @ 0x2] Picture size 0x0 is invalid";
        assert_eq!(
            fault(&[size, failed]),
            damage("Picture size 0x0 is invalid")
        );
        let missing = "[h264 @ 0x1] Missing reference picture, default is 65596";
        assert_eq!(
            fault(&[missing, "Error while decoding"]),
            Some(Fault::Reference)
        );
        let encoded = ["Error submitting video frame", "Cannot allocate memory"];
        assert_eq!(fault(&encoded), Some(Fault::Memory));
        let failed = "Error while opening decoder for input stream #0:0 : Invalid argument";
        assert_eq!(fault(&[unlisted, failed]), Some(Fault::UnreadCodec));
        let unknown = "Decoder (codec none) not found for input stream #0:0";
        assert_eq!(fault(&[unknown]), Some(Fault::UnreadCodec));
        // The unread codec may be that of the sound, which says nothing about the pictures.
        assert_eq!(
            fault(&[unlisted, "[h264 @ 0x1] no extradata", failed]),
            damage("no extradata")
        );
    }

    /// Damage that is found ahead of the pictures counts only where the program ends.
    #[test]
    fn damage_counts_at_the_end_where_the_program_ends_at_it() {
        let nal = "[h264 @ 0x1] Invalid NAL unit size (9 > 5).";
        let reference = "[h264 @ 0x1] no frame!";
        let mkv = "[matroska,webm @ 0x1] 0x00 at pos 9 invalid as first byte of an EBML number";
        let gif = "[gif @ 0x1] LZW decode failed";
        for (lines, leaves_out, is_at_once) in [
            (vec![nal], false, false),
            (vec![nal, reference], false, false),
            (vec![nal], true, true),
            (vec![mkv], false, true),
            (vec![gif], false, true),
            (vec![reference, nal], false, true),
        ] {
            let said = Said::new(leaves_out);
            said.hear(lines.join("\n").as_bytes());
            assert_eq!(said.fault().is_some(), is_at_once, "{lines:?}");
            assert!(said.fault_in_all().is_some(), "{lines:?}");
        }
    }
}
