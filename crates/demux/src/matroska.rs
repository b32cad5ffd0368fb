//! Matroska and WebM (RFC 9559).

use crate::{DemuxError, Index, Sample, VP9};
use matroska_demuxer::{Frame, MatroskaFile, TrackEntry, TrackType};
use std::cell::RefCell;
use std::io::{self, Read, Seek, SeekFrom};
use std::rc::Rc;

/// H.264 of any profile and level. A decoder reads the true ones in the pictures.
const H264: &str = "avc1.640034";

pub fn index<R: Read + Seek>(reader: R) -> Result<Index, DemuxError> {
    let reads = Reads::default();
    let reader = Recorded {
        reader,
        reads: Rc::clone(&reads),
    };
    let mut file = MatroskaFile::open(reader)?;
    let tracks = file.tracks().iter();
    let track = { tracks }.find(|track| track.track_type() == TrackType::Video);
    let track = track.ok_or(DemuxError::NoPictures)?;
    let (codec, description) = codec(track)?;
    let number = track.track_number().get();
    let scale = file.info().timestamp_scale().get();
    let mut samples = Vec::new();
    let mut frame = Frame::default();
    loop {
        reads.borrow_mut().clear();
        if !file.next_frame(&mut frame)? {
            break;
        }
        if frame.track != number || frame.data.is_empty() {
            continue;
        }
        samples.push(Sample {
            offset: offset(&reads.borrow(), &frame.data)?,
            size: u32::try_from(frame.data.len()).map_err(|_| DemuxError::Order)?,
            time: (frame.timestamp.saturating_mul(scale) / 1000).cast_signed(),
            // A block in a group does not tell whether it is a key frame.
            is_key: frame.is_keyframe.unwrap_or(samples.is_empty()),
            is_shown: !frame.is_invisible,
        });
    }
    Ok(Index {
        codec,
        description,
        rotation: 0,
        samples,
    })
}

/// The codec of a track, and what a decoder must know before the first sample.
fn codec(track: &TrackEntry) -> Result<(String, Option<Vec<u8>>), DemuxError> {
    let unknown = || DemuxError::Codec(track.codec_id().to_owned());
    if track.content_encodings().is_some_and(|it| !it.is_empty()) {
        return Err(unknown());
    }
    match (track.codec_id(), track.codec_private()) {
        ("V_VP8", _) => Ok(("vp8".to_owned(), None)),
        ("V_VP9", _) => Ok((VP9.to_owned(), None)),
        ("V_MPEG4/ISO/AVC", Some(config @ [1, profile, constraints, level, ..])) => {
            let codec = format!("avc1.{profile:02x}{constraints:02x}{level:02x}");
            Ok((codec, Some(config.to_vec())))
        }
        // A byte stream: the parameters stand before each key picture, the level among them.
        ("V_MPEG4/ISO/AVC", _) => Ok((H264.to_owned(), None)),
        // The AV1 Codec ISO Media File Format Binding, 2.3.3.
        ("V_AV1", Some([_, profile_and_level, depth, ..])) => {
            let tier = if depth & 0x80 == 0 { 'M' } else { 'H' };
            let bits = [8, 10][usize::from(depth >> 6 & 1)] + 2 * (depth >> 5 & 1);
            let (profile, level) = (profile_and_level >> 5, profile_and_level & 31);
            Ok((format!("av01.{profile}.{level:02}{tier}.{bits:02}"), None))
        }
        _ => Err(unknown()),
    }
}

/// Where the bytes of a frame were read from.
fn offset(reads: &[(usize, u64)], data: &[u8]) -> Result<u64, DemuxError> {
    let place = data.as_ptr().addr();
    let read = reads.iter().rev().find(|(to, _)| *to == place);
    read.map(|(_, from)| *from).ok_or(DemuxError::Order)
}

/// Reads since the last frame: the address that was read to, and the offset in the file. The demuxer does not tell the
/// offset of a frame.
type Reads = Rc<RefCell<Vec<(usize, u64)>>>;

struct Recorded<R> {
    reader: R,
    reads: Reads,
}

impl<R: Read + Seek> Read for Recorded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }

    fn read_exact(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        let from = self.reader.stream_position()?;
        self.reads.borrow_mut().push((buffer.as_ptr().addr(), from));
        self.reader.read_exact(buffer)
    }
}

impl<R: Seek> Seek for Recorded<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.reader.seek(to)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.reader.stream_position()
    }
}
