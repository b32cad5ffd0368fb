//! A reader that keeps the bytes that it has read ahead when a seek stays among them: demuxers seek from box to box.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

/// Bytes that are read ahead.
const AHEAD: usize = 256 << 10;

#[derive(Debug)]
pub struct Buffered<R> {
    reader: BufReader<R>,
    /// The length of the file, in bytes.
    size: u64,
}

impl<R: Read> Buffered<R> {
    pub fn new(reader: R, size: u64) -> Self {
        let reader = BufReader::with_capacity(AHEAD, reader);
        Self { reader, size }
    }
}

impl<R: Read> Read for Buffered<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }

    fn read_exact(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.reader.read_exact(buffer)
    }
}

impl<R: Seek> Seek for Buffered<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let from = self.reader.stream_position()?;
        let to = match to {
            SeekFrom::Start(offset) => Some(offset),
            SeekFrom::Current(by) => from.checked_add_signed(by),
            SeekFrom::End(by) => self.size.checked_add_signed(by),
        };
        // A Matroska element whose size is unknown has the largest size there is; it ends with the file.
        let to = to.ok_or(io::ErrorKind::InvalidInput)?.min(self.size);
        self.reader
            .seek_relative(to.cast_signed() - from.cast_signed())?;
        Ok(to)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.reader.stream_position()
    }
}
