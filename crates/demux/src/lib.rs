//! Where the frames of a video file are, and when each is shown: what a decoder needs.
//!
//! ```
//! # fn print(path: &std::path::Path) -> Result<(), Box<dyn std::error::Error>> {
//! let index = bagtrack_demux::index(std::fs::File::open(path)?)?;
//! for sample in &index.samples {
//!     println!("{} bytes at {}, shown at {} µs", sample.size, sample.offset, sample.time);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The page in the browser reads the files of its users with it ([`js`]), so that it sees each frame exactly once: an
//! element that plays a file does not tell which frames it has. A file that is refused here is played instead.

mod buffered;
mod matroska;
mod mp4;

pub mod js;

use buffered::Buffered;
use std::io::{Read, Seek, SeekFrom};
use thiserror::Error;

/// The video of a file: its first track of pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Index {
    /// As `codec` of a `VideoDecoderConfig` of WebCodecs: "avc1.64001f".
    pub codec: String,
    /// As `description` of a `VideoDecoderConfig`: what a decoder of H.264 or H.265 must know before the first sample.
    pub description: Option<Vec<u8>>,
    /// How far the pictures are to be turned clockwise, in degrees: 0, 90, 180 or 270.
    pub rotation: u16,
    /// The samples, in the order of decoding. The first can be decoded without the others.
    pub samples: Vec<Sample>,
}

/// An encoded picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Its first byte in the file.
    pub offset: u64,
    /// Its length in bytes.
    pub size: u32,
    /// When it is shown, in microseconds. No two samples that are shown have the same time.
    pub time: i64,
    /// Whether it can be decoded without the ones before it.
    pub is_key: bool,
    /// Whether it is shown. Others are decoded because later ones need them.
    pub is_shown: bool,
}

/// Why a file has no index.
#[derive(Debug, Error)]
pub enum DemuxError {
    /// The file cannot be read, or ends too early.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is not an MP4 file, or a damaged one.
    #[error(transparent)]
    Mp4(#[from] re_mp4::Error),
    /// The file is a damaged Matroska file.
    #[error(transparent)]
    Matroska(#[from] matroska_demuxer::DemuxError),
    /// The file has no pictures, or none of them is shown.
    #[error("the file has no pictures")]
    NoPictures,
    /// No browser decodes the pictures, or they are packed in a way that is not known here.
    #[error("pictures as {0} are not known")]
    Codec(String),
    /// The pictures are mirrored or skewed.
    #[error("the pictures are not only turned by quarters")]
    Turned,
    /// Parts of the track are repeated, left out or shown at another speed.
    #[error("the file shows more than one part of its track")]
    Edited,
    /// Two pictures have the same time, or the first one needs another one.
    #[error("the pictures are in no order that can be decoded")]
    Order,
}

/// VP9 of any profile and level. The string says profile 0, level 5.1, 8 bits; a decoder reads the true ones in the
/// pictures.
const VP9: &str = "vp09.00.51.08";
/// The bytes that a Matroska file begins with.
const EBML: [u8; 4] = [0x1a, 0x45, 0xdf, 0xa3];

/// Reads what a file says of its pictures: of MP4 and MOV the boxes around the pictures, of WebM and Matroska the whole
/// file.
///
/// # Errors
/// [`DemuxError`]: for a file that has no index which can be relied on.
///
/// # Panics
/// A damaged MP4 file may make its reader panic.
pub fn index<R: Read + Seek>(mut reader: R) -> Result<Index, DemuxError> {
    let mut begin = [0; EBML.len()];
    reader.read_exact(&mut begin)?;
    let size = reader.seek(SeekFrom::End(0))?;
    reader.rewind()?;
    let reader = Buffered::new(reader, size);
    let mut index = match begin == EBML {
        true => matroska::index(reader),
        false => mp4::index(reader, size),
    }?;
    // Of a file that ends too early, the samples before its end are kept.
    let is_there = |it: &Sample| it.offset.saturating_add(it.size.into()) <= size;
    let count = index.samples.iter().take_while(|it| is_there(it)).count();
    index.samples.truncate(count);
    index.check()
}

impl Index {
    fn check(self) -> Result<Self, DemuxError> {
        let mut times: Vec<i64> = self.shown().map(|sample| sample.time).collect();
        if times.is_empty() {
            return Err(DemuxError::NoPictures);
        }
        times.sort_unstable();
        let is_decodable = self.samples[0].is_key;
        match is_decodable && times.windows(2).all(|pair| pair[0] < pair[1]) {
            true => Ok(self),
            false => Err(DemuxError::Order),
        }
    }

    fn shown(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|sample| sample.is_shown)
    }
}
