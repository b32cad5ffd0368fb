//! ffmpeg's output for a video: for each picture a line of the format `framecrc`, then the picture as a JPEG file.

use std::io::{self, BufRead, ErrorKind, Read};

/// The program's output. Lines come unbuffered, so that each stands before its picture.
pub(super) const FORMAT: [&str; 3] = [
    "-f",
    "tee",
    "[f=framecrc:flush_packets=1]pipe:1|[f=mjpeg:flush_packets=1]pipe:1",
];
/// The arguments for the unit of times in the output: microseconds.
pub(super) const TIME_BASE: [&str; 2] = ["-enc_time_base", "1:1000000"];
const SECOND: f64 = 1e6;
const MAX_LINE: u64 = 256;

/// A picture of a video.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoPicture {
    /// A JPEG file.
    pub jpeg: Vec<u8>,
    /// When it is shown, in seconds from where decoding began: the start time of the file, or the time that was asked
    /// for.
    pub time: f64,
}

/// The next picture, of at most `max_bytes` bytes; `None` at the end.
pub(super) fn next_picture(
    stream: &mut impl BufRead,
    max_bytes: usize,
) -> io::Result<Option<VideoPicture>> {
    loop {
        let mut line = Vec::new();
        stream
            .by_ref()
            .take(MAX_LINE)
            .read_until(b'\n', &mut line)?;
        if line.is_empty() {
            return Ok(None);
        }
        // Lines of the head describe the stream.
        if line.starts_with(b"#") {
            continue;
        }
        let Some((time, length)) = time_and_length(&line) else {
            let text = "the program's output is none that is known";
            return Err(io::Error::new(ErrorKind::InvalidData, text));
        };
        if length > max_bytes {
            let text = format!("a picture has {length} bytes, and {max_bytes} are taken");
            return Err(io::Error::new(ErrorKind::InvalidData, text));
        }
        let mut jpeg = vec![0; length];
        return match stream.read_exact(&mut jpeg) {
            Ok(()) => Ok(Some(VideoPicture { jpeg, time })),
            // The program was ended within a picture.
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(error),
        };
    }
}

/// The time in seconds and the length in bytes of a line, whose fields are: stream, time of decoding, time of showing,
/// duration, bytes, and more.
fn time_and_length(line: &[u8]) -> Option<(f64, usize)> {
    let mut fields = str::from_utf8(line).ok()?.split(',').map(str::trim);
    let time: i64 = fields.nth(2)?.parse().ok()?;
    let length = fields.nth(1)?.parse().ok()?;
    Some((time as f64 / SECOND, length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_cut_out_by_their_lengths_and_have_their_times() {
        let stream =
            b"#software: x\n#tb 0: 1/1000000\n0,  0,  0, 33333, 4, 0x034c072f, S=1, 8\n#\n\n#\
            0, 33333, 1500000, 33333, 2, 0x8d9ed616\nab0, 0, 0, 0, 9, 0x1\nabc";
        let mut stream = &stream[..];
        let mut next = || next_picture(&mut stream, 8);
        let picture = |jpeg: &[u8], time| VideoPicture {
            jpeg: jpeg.to_vec(),
            time,
        };
        assert_eq!(next().unwrap().unwrap(), picture(b"#\n\n#", 0.0));
        assert_eq!(next().unwrap().unwrap(), picture(b"ab", 1.5));
        assert!(next().is_err(), "9 bytes are too many");
        let mut cut = &b"0, 0, 0, 0, 5, 0x1\nabc"[..];
        assert_eq!(next_picture(&mut cut, 8).unwrap(), None);
        let mut unknown = &b"Content-length: 5\nabcde"[..];
        assert!(next_picture(&mut unknown, 8).is_err());
    }
}
