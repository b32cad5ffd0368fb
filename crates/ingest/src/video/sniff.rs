//! Whether bytes are a video.

use super::super::sniff::type_name;

/// How a video is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VideoFormat {
    /// MP4, WebM, Matroska, GIF: their first bytes tell.
    Container,
    /// JPEG files one after the other.
    MotionJpeg,
}

/// The types that the first box of an MP4 or QuickTime file may have. Older cameras write no `ftyp`.
const BOXES: [&[u8; 4]; 7] = [
    b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip", b"pnot",
];

/// The format of bytes that came with this media type; `None` where they are no video.
pub fn video_format(bytes: &[u8], media_type: &str) -> Option<VideoFormat> {
    let is_boxed = bytes
        .get(4..8)
        .is_some_and(|kind| BOXES.iter().any(|known| *known == kind));
    let is_container = is_boxed && type_name(bytes).is_none()
        || bytes.starts_with(b"\x1A\x45\xDF\xA3")
        || bytes.starts_with(b"GIF8");
    let essence = media_type.split(';').next().unwrap_or("").trim();
    let is_motion = matches!(essence, "video/x-motion-jpeg" | "video/x-mjpeg");
    match (is_container, is_motion && bytes.starts_with(b"\xFF\xD8")) {
        (true, _) => Some(VideoFormat::Container),
        (_, true) => Some(VideoFormat::MotionJpeg),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The letters `ftyp` at byte 4 must not make a JPEG count as an MP4 file.
    #[test]
    fn a_jpeg_whose_first_segment_spells_ftyp_is_a_picture() {
        let jpeg = b"\xFF\xD8\xFF\xE0ftyp";
        assert_eq!(video_format(jpeg, ""), None);
        let motion = video_format(jpeg, "video/x-motion-jpeg");
        assert_eq!(motion, Some(VideoFormat::MotionJpeg));
        for start in [b"\0\0\0\x18ftypisom", b"\0\0\0\x08wide\0\x01\x20\x30"] {
            assert_eq!(video_format(start, ""), Some(VideoFormat::Container));
        }
        assert_eq!(video_format(b"\0\0\0\x18ftypavif", ""), None);
    }
}
