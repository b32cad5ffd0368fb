//! The type of an image, by its first bytes.

use super::error::IngestError;

/// The image types that are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Jpeg,
    Png,
    WebP,
}

impl Format {
    fn name(self) -> &'static str {
        match self {
            Format::Jpeg => "JPEG",
            Format::Png => "PNG",
            Format::WebP => "WebP",
        }
    }

    /// The error for an image of this type that cannot be decoded.
    pub(super) fn damaged(self, reason: impl Into<String>) -> IngestError {
        IngestError::Damaged {
            format: self.name(),
            reason: reason.into(),
        }
    }
}

/// Types that are known and not read, by the brands of their `ftyp` box. HEIC is an iPhone's, AVIF Android's and the
/// web's. A file with a general major brand names its own type among its compatible brands.
const HEIC: [&[u8; 4]; 8] = [
    b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"hevm", b"hevs",
];
const AVIF: [&[u8; 4]; 2] = [b"avif", b"avis"];
const GENERAL: [&[u8; 4]; 4] = [b"mif1", b"mif2", b"msf1", b"miaf"];
/// Most brands that are looked at.
const MAX_BRANDS: usize = 16;

/// The name of the image type that the first bytes tell, even of a type that is not read.
pub fn type_name(bytes: &[u8]) -> Option<&'static str> {
    let read = format(bytes).map(Format::name);
    read.or_else(|| unread_type(bytes))
}

/// Bytes of a packet of an MPEG transport stream; bytes of the time stamp that cameras put before each; a packet's
/// first byte.
const PACKET: usize = 188;
const STAMP: usize = 4;
const SYNC: u8 = 0x47;

/// The name of a type of images, videos or packed files that is known and not read.
pub fn unread_type(bytes: &[u8]) -> Option<&'static str> {
    if bytes.get(4..8) == Some(b"ftyp") {
        return still_image(bytes);
    }
    let signatures: [(&[u8], &str); 17] = [
        (b"II\x2A\x00", "TIFF"),
        (b"MM\x00\x2A", "TIFF"),
        (b"\xFF\x0A", "JPEG XL"),
        (b"\x00\x00\x00\x0CJXL \r\n", "JPEG XL"),
        (b"\x00\x00\x00\x0CjP  \r\n", "JPEG 2000"),
        (b"FLV\x01", "FLV"),
        (b"\x30\x26\xB2\x75\x8E\x66\xCF\x11", "WMV"),
        (b"\x00\x00\x01\xBA", "MPEG"),
        (b"\x00\x00\x01\xB3", "MPEG"),
        (b"\x00\x00\x00\x01\x67", "raw H.264"),
        (b"\x00\x00\x00\x01\x40", "raw H.265"),
        (b"\x06\x0E\x2B\x34", "MXF"),
        (b"OggS", "Ogg"),
        (b"DKIF", "IVF"),
        (b"YUV4MPEG2 ", "Y4M"),
        (b"\x1F\x8B\x08", "gzip"),
        (b"PK\x03\x04", "ZIP"),
    ];
    let found = signatures
        .iter()
        .find(|(start, _)| bytes.starts_with(start));
    // Two letters may begin any text. A bitmap has four zeros after its length.
    let is_bitmap = bytes.starts_with(b"BM") && bytes.get(6..10) == Some(&[0; 4]);
    let is_avi = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"AVI ");
    let has_packets = |stamp: usize| {
        let mut starts = (0..3).map(|index| stamp + index * (stamp + PACKET));
        starts.all(|at| bytes.get(at) == Some(&SYNC))
    };
    let is_packets = has_packets(0) || has_packets(STAMP);
    let of_parts = [(is_bitmap, "BMP"), (is_avi, "AVI"), (is_packets, "MPEG-TS")];
    let found = found.map(|(_, name)| *name);
    found.or_else(|| of_parts.iter().find(|(is, _)| *is).map(|(_, name)| *name))
}

/// Whether the bytes are text in UTF-8, which may be cut off. Images and videos have control characters in their first
/// bytes.
pub fn is_text(bytes: &[u8]) -> bool {
    let is_utf8 =
        std::str::from_utf8(bytes).map_or_else(|error| error.error_len().is_none(), |_| true);
    let is_letter = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    is_utf8 && !bytes.is_empty() && bytes.iter().all(is_letter)
}

/// Least length of a text that counts as base64: a shorter one may be a name.
const MIN_BASE64: usize = 128;

/// Whether the bytes are base64, in the standard alphabet or that of URLs, in lines or not, or a data URL with base64.
pub fn is_base64(bytes: &[u8]) -> bool {
    const MARK: &[u8] = b";base64,";
    let head = &bytes[..bytes.len().min(64)];
    let mark = head.windows(MARK.len()).position(|part| part == MARK);
    let text = match mark {
        Some(at) if bytes.starts_with(b"data:") => &bytes[at + MARK.len()..],
        _ => bytes,
    };
    let is_letter = |byte: &u8| byte.is_ascii_alphanumeric() || b"+/-_=\r\n".contains(byte);
    text.len() >= MIN_BASE64 && text.iter().all(is_letter)
}

/// The type of still image of a file of ISO boxes; `None` where it is a video.
fn still_image(bytes: &[u8]) -> Option<&'static str> {
    let length = bytes
        .first_chunk()
        .map(|length| u32::from_be_bytes(*length))?;
    let brands = bytes.get(8..bytes.len().min(length as usize))?;
    let mut brands = brands.chunks_exact(4);
    let major = brands.next()?;
    // The minor version comes first; as one of the chunks it names no known brand.
    let compatible = brands.take(MAX_BRANDS);
    let name = |brand: &[u8]| {
        let is_of = |brands: &[&[u8; 4]]| brands.iter().any(|known| *known == brand);
        match (is_of(&HEIC), is_of(&AVIF)) {
            (true, _) => Some("HEIC"),
            (_, true) => Some("AVIF"),
            _ => None,
        }
    };
    let is_general = GENERAL.iter().any(|brand| *brand == major);
    let general = || is_general.then(|| compatible.filter_map(name).next().unwrap_or("HEIF"));
    name(major).or_else(general)
}

/// The type that the signature at the start of `bytes` tells, if it is one that is read.
pub(super) fn format(bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(&[0xFF, 0xD8, 0xFF]) {
        Some(Format::Jpeg)
    } else if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some(Format::Png)
    } else if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        Some(Format::WebP)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_that_are_not_read_are_named_and_videos_are_none() {
        for (bytes, name) in [
            (&b"\0\0\0\x24ftypheic\0\0\0\0mif1heic"[..], Some("HEIC")),
            (b"\0\0\0\x20ftypmif1\0\0\0\0mif1heicmiaf", Some("HEIC")),
            (b"\0\0\0\x1cftypavif\0\0\0\0avifmif1miaf", Some("AVIF")),
            (b"\0\0\0\x1cftypmif1\0\0\0\0avifmiafmif1", Some("AVIF")),
            (b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2avc1mp41", None),
            (b"\0\0\0\x14ftypqt  \0\0\0\0qt  ", None),
            (b"\0\0\0\x08ftyp", None),
            (b"II*\0", Some("TIFF")),
            (b"BM\x36\x10\0\0\0\0\0\0", Some("BMP")),
            (b"BM, a text", None),
            (b"RIFF\x24\x10\0\0AVI LIST", Some("AVI")),
            (b"RIFF\x24\x10\0\0WAVEfmt ", None),
            (
                &[&[0x47; 1][..], &[0; 187]].concat().repeat(3),
                Some("MPEG-TS"),
            ),
            (
                &[&[0, 0, 0, 1, 0x47][..], &[0; 187]].concat().repeat(3),
                Some("MPEG-TS"),
            ),
            (b"OggS\0\x02", Some("Ogg")),
            (b"\x06\x0E\x2B\x34\x02\x05", Some("MXF")),
            (&[0x47; 188], None),
            (b"\x1F\x8B\x08\0", Some("gzip")),
            (b"", None),
        ] {
            assert_eq!(unread_type(bytes), name, "{bytes:?}");
        }
    }
}
