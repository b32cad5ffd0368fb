//! The pictures in a multipart stream of JPEG files, in which each has its length before it.

use std::io::{self, BufRead, ErrorKind, Read};

const MAX_LINE: u64 = 256;

/// The next picture, of at most `max_bytes` bytes; none at the end.
pub(super) fn next_part(
    stream: &mut impl BufRead,
    max_bytes: usize,
) -> io::Result<Option<Vec<u8>>> {
    let mut length = None;
    loop {
        let mut line = String::new();
        if stream.by_ref().take(MAX_LINE).read_line(&mut line)? == 0 {
            return Ok(None);
        }
        let line = line.trim().to_ascii_lowercase();
        if let Some(text) = line.strip_prefix("content-length:") {
            length = text.trim().parse::<usize>().ok();
        }
        if let (true, Some(length)) = (line.is_empty(), length) {
            if length > max_bytes {
                let text = format!("a picture has {length} bytes, and {max_bytes} are taken");
                return Err(io::Error::new(ErrorKind::InvalidData, text));
            }
            let mut picture = vec![0; length];
            return match stream.read_exact(&mut picture) {
                Ok(()) => Ok(Some(picture)),
                // The program was ended.
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
                Err(error) => Err(error),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_cut_out_by_their_lengths() {
        let stream = b"--ffmpeg\r\nContent-type: image/jpeg\r\nContent-length: 4\r\n\r\n\r\n\r\n\r\n--ffmpeg\r\n\
            Content-type: image/jpeg\r\nContent-length: 2\r\n\r\nab\r\n--ffmpeg\r\nContent-length: 9\r\n\r\nabc";
        let mut stream = &stream[..];
        let mut next = || next_part(&mut stream, 8);
        assert_eq!(next().unwrap().unwrap(), b"\r\n\r\n");
        assert_eq!(next().unwrap().unwrap(), b"ab");
        assert!(next().is_err(), "9 bytes are too many");
        let mut cut = &b"Content-length: 5\r\n\r\nabc"[..];
        assert_eq!(next_part(&mut cut, 8).unwrap(), None);
    }
}
