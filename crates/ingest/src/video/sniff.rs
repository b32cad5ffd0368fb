//! Whether bytes are a video.

use super::super::sniff::unread_type;

/// How a video is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VideoFormat {
    /// MP4, WebM, Matroska, GIF: their first bytes tell.
    Container,
    /// JPEG files one after the other.
    MotionJpeg,
}

/// The format of bytes that came with this media type; none where they are no video.
pub fn video_format(bytes: &[u8], media_type: &str) -> Option<VideoFormat> {
    let is_container = bytes.get(4..8) == Some(b"ftyp") && unread_type(bytes).is_none()
        || bytes.starts_with(b"\x1A\x45\xDF\xA3")
        || bytes.starts_with(b"GIF8");
    let is_motion = matches!(media_type, "video/x-motion-jpeg" | "video/x-mjpeg");
    match (is_container, is_motion && bytes.starts_with(b"\xFF\xD8")) {
        (true, _) => Some(VideoFormat::Container),
        (_, true) => Some(VideoFormat::MotionJpeg),
        _ => None,
    }
}
