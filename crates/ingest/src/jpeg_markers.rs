//! The marker structure of a JPEG (ITU-T T.81, annex B), read before decoding: whether the file is whole, and what
//! decoding it costs. The decoder does not notice when only the end of the last scan is missing.

use memchr::memchr;
use std::ops::Range;

/// One component of the frame header: its horizontal and vertical sampling factors.
type Sampling = (u32, u32);

/// Bytes of one-bits: more bits than the longest code (16) and the value behind it (16) can use up.
const GUARD_BYTES: usize = 8;

/// What an APP1 segment with an EXIF block begins with.
const EXIF: &[u8] = b"Exif\0\0";

/// What the markers say about the image.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Markers {
    pub(super) width: u32,
    pub(super) height: u32,
    /// The low four bits of the code of its start-of-frame marker.
    process: u8,
    components: Vec<Sampling>,
    scans: usize,
    entropy_coded_bytes: u64,
    /// Where the EXIF block is, from its TIFF header on.
    exif: Option<Range<usize>>,
    /// Where the end-of-image marker is.
    end: usize,
}

impl Markers {
    /// Reads from the start to the end-of-image marker.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, &'static str> {
        let mut frame = None;
        let mut exif = None;
        let mut scans = 0;
        let mut entropy_coded_bytes = 0;
        let mut at = 2;
        loop {
            let (marker, after) = next_marker(bytes, at).ok_or("it is cut short")?;
            at = after;
            match marker {
                0xD9 => break,
                0x01 | 0xD0..=0xD7 => continue,
                0xD8 => return Err("a second image starts inside the first"),
                _ => {}
            }
            let length = bytes.get(at..at + 2).ok_or("it is cut short")?;
            let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
            if length < 2 {
                return Err("a segment is shorter than its own length field");
            }
            let segment = bytes.get(at + 2..at + length).ok_or("it is cut short")?;
            at += length;
            match marker {
                // Start of frame: all of C0 to CF but Huffman tables, extensions and arithmetic conditioning.
                0xC0..=0xCF if ![0xC4, 0xC8, 0xCC].contains(&marker) => {
                    if frame.is_some() {
                        return Err("it has two frame headers");
                    }
                    frame = Some((marker, FrameHeader::read(segment)?));
                }
                0xE1 if segment.starts_with(EXIF) => {
                    exif = Some(at - segment.len() + EXIF.len()..at);
                }
                0xDA => {
                    scans += 1;
                    let end = end_of_scan(bytes, at).ok_or("it is cut short")?;
                    entropy_coded_bytes += (end - at) as u64;
                    at = end;
                }
                _ => {}
            }
        }
        let (marker, header) = frame.ok_or("it has no frame header")?;
        Ok(Self {
            width: header.width,
            height: header.height,
            process: marker & 15,
            components: header.components,
            scans,
            entropy_coded_bytes,
            exif,
            end: at - 2,
        })
    }

    /// Why the decoder would give a wrong image, without an error, for this valid but rare layout.
    pub(super) fn unsupported(&self, is_cmyk: bool) -> Option<&'static str> {
        let largest = self.largest_sampling();
        if self.components[0] != largest || (is_cmyk && largest != (1, 1)) {
            return Some("its first channel is subsampled, which is not supported");
        }
        if !self.is_progressive() && self.scans > 1 && largest.1 > 1 {
            return Some(
                "its channels come one after the other with vertical subsampling, which is not supported; \
                 progressive and interleaved files are",
            );
        }
        None
    }

    /// Whether the file is like nearly all: baseline, extended or progressive with Huffman codes, with one or three
    /// channels, in a layout that zune-jpeg takes.
    #[cfg(feature = "turbo")]
    pub(super) fn is_usual(&self) -> bool {
        self.process <= 2
            && matches!(self.components.len(), 1 | 3)
            && self.unsupported(false).is_none()
    }

    /// Whether the file is baseline or extended with Huffman codes, in a single scan.
    pub(super) fn is_sequential(&self) -> bool {
        self.process <= 1 && self.scans == 1
    }

    /// Where the image ends, its end marker included.
    #[cfg(feature = "turbo")]
    pub(super) fn after_end(&self) -> usize {
        self.end + 2
    }

    /// The largest of these divisors, in falling order, that divides both sides and leaves at least the working size.
    /// With a divisor that leaves a rest, the last column would stand for fewer pixels than the others, and boxes would
    /// be off.
    pub(super) fn reduction(&self, working: (u32, u32), divisors: &[u32]) -> u32 {
        let fits = |side: u32, working: u32, divisor: u32| {
            side.is_multiple_of(divisor) && side / divisor >= working
        };
        let mut divisors = divisors.iter().copied();
        divisors
            .find(|&by| fits(self.width, working.0, by) && fits(self.height, working.1, by))
            .unwrap_or(1)
    }

    fn is_progressive(&self) -> bool {
        self.process == 2
    }

    /// Whether zune-jpeg can leave colour out. It decodes wrongly where colour has half the rows but all columns.
    pub(super) fn can_skip_color(&self) -> bool {
        matches!(self.largest_sampling(), (_, 1) | (2, 2))
    }

    /// Whether chroma has half or all of the luma's columns and rows. The decoder garbles other chroma.
    pub(super) fn has_usual_chroma(&self) -> bool {
        matches!(self.largest_sampling(), (1 | 2, 1 | 2))
    }

    /// The EXIF block of the image that these markers are of.
    pub(super) fn exif<'a>(&self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        bytes.get(self.exif.clone()?)
    }

    /// Copies the image to `guarded`, with one-bits before its end marker. After the end marker the decoder reads
    /// zero-bits without end, and makes gray blocks of them (docs/upstream/zune-jpeg.md). A run of one-bits is a code
    /// that no Huffman table has (T.81, annex C), so where blocks are missing the decoder must report an error. The
    /// decoder has decoded a whole image before it gets there. Images whose channels come one after the other get no
    /// guard: with restarts, the decoder reads past the end of the last channel.
    pub(super) fn with_guarded_end(&self, bytes: &[u8], guarded: &mut Vec<u8>) {
        let guard_bytes = if self.is_progressive() || self.scans == 1 {
            GUARD_BYTES
        } else {
            0
        };
        guarded.clear();
        guarded.extend_from_slice(&bytes[..self.end]);
        // A byte of ones in entropy-coded data is written with a zero byte after it.
        guarded.extend([0xFF, 0x00].repeat(guard_bytes));
        guarded.extend([0xFF, 0xD9]);
    }

    /// Most bytes that decoding to pixels allocates, with `output_channels` bytes a pixel.
    pub(super) fn memory(&self, output_channels: u64) -> u64 {
        let pixels = u64::from(self.width) * u64::from(self.height);
        pixels * output_channels + self.working_memory()
    }

    /// Most bytes that decoding to the stored components allocates, in whole blocks.
    pub(super) fn memory_of_components(&self) -> u64 {
        self.samples() + self.working_memory()
    }

    /// Bytes besides the output: rows of blocks and, where the image comes in several scans, 16-bit coefficients for
    /// every sample of every component.
    fn working_memory(&self) -> u64 {
        let v_max = self.largest_sampling().1;
        let row_buffers = 16 * u64::from(self.width + 64) * u64::from(v_max) * 8;
        if !self.is_progressive() && self.scans < 2 {
            return row_buffers;
        }
        row_buffers + self.samples() * 2
    }

    /// How many samples the components have, in whole blocks.
    fn samples(&self) -> u64 {
        let (h_max, v_max) = self.largest_sampling();
        let unit_columns = u64::from(self.width.div_ceil(8 * h_max));
        let unit_rows = u64::from(self.height.div_ceil(8 * v_max));
        let blocks: u64 = self
            .components
            .iter()
            .map(|&(h, v)| u64::from(h) * u64::from(v) * unit_columns * unit_rows)
            .sum();
        blocks * 64
    }

    /// Whether there are fewer bits than any encoder needs: at least one, the DC code, for each 8 x 8 block of the
    /// component with the most blocks. This refuses a few hundred bytes that claim forty million pixels.
    pub(super) fn is_implausibly_small(&self) -> bool {
        let (h_max, v_max) = self.largest_sampling();
        let blocks = self
            .components
            .iter()
            .map(|&(h, v)| {
                u64::from((self.width * h).div_ceil(8 * h_max))
                    * u64::from((self.height * v).div_ceil(8 * v_max))
            })
            .max()
            .unwrap_or(0);
        self.entropy_coded_bytes * 8 < blocks
    }

    fn largest_sampling(&self) -> Sampling {
        self.components
            .iter()
            .fold((1, 1), |(h_max, v_max), &(h, v)| {
                (h_max.max(h), v_max.max(v))
            })
    }
}

struct FrameHeader {
    width: u32,
    height: u32,
    components: Vec<Sampling>,
}

impl FrameHeader {
    fn read(segment: &[u8]) -> Result<Self, &'static str> {
        let [_, h1, h0, w1, w0, count, components @ ..] = segment else {
            return Err("its frame header is too short");
        };
        let (components, rest) = components.as_chunks::<3>();
        if components.len() != usize::from(*count) || !rest.is_empty() || components.is_empty() {
            return Err("its frame header has another length than its components need");
        }
        let components: Vec<Sampling> = components
            .iter()
            .map(|[_, sampling, _]| (u32::from(sampling >> 4), u32::from(sampling & 15)))
            .collect();
        if components
            .iter()
            .any(|&(h, v)| !(1..=4).contains(&h) || !(1..=4).contains(&v))
        {
            return Err("a sampling factor is not 1 to 4");
        }
        Ok(Self {
            width: u32::from(u16::from_be_bytes([*w1, *w0])),
            height: u32::from(u16::from_be_bytes([*h1, *h0])),
            components,
        })
    }
}

/// The next marker's code, at or after `at`, and where its segment begins. Fill bytes are skipped.
fn next_marker(bytes: &[u8], mut at: usize) -> Option<(u8, usize)> {
    loop {
        at += memchr(0xFF, bytes.get(at..)?)?;
        at += bytes[at..].iter().position(|&byte| byte != 0xFF)?;
        if bytes[at] != 0 {
            return Some((bytes[at], at + 1));
        }
    }
}

/// Where entropy-coded data that begins at `at` ends: at the first marker that is not a restart.
fn end_of_scan(bytes: &[u8], mut at: usize) -> Option<usize> {
    loop {
        at += memchr(0xFF, bytes.get(at..)?)?;
        match *bytes.get(at + 1)? {
            0x00 | 0xD0..=0xD7 => at += 2,
            0xFF => at += 1,
            _ => return Some(at),
        }
    }
}
