//! Frames whose cost can be told from their head: plain JPEGs.

use super::jpeg_markers::next_marker;
use super::sniff::{self, Format};

/// Width and height, as stored, that the head of a plain JPEG claims: one that is decoded row by row in a single pass (baseline
/// or extended, all channels in its first scan), with no more bytes than pixels, as nearly all frames of cameras are. None for
/// everything else, whose head says less of what decoding it will cost.
///
/// Nothing is decoded, and the file may still prove to be damaged.
pub fn plain_size(bytes: &[u8]) -> Option<(u32, u32)> {
    if sniff::format(bytes) != Some(Format::Jpeg) {
        return None;
    }
    let mut frame = None;
    let mut at = 2;
    loop {
        let (marker, after) = next_marker(bytes, at)?;
        let length = bytes.get(after..after + 2)?;
        let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
        let segment = bytes.get(after + 2..after + length)?;
        at = after + length;
        match (marker, segment) {
            // Start of frame, baseline or extended: precision, height, width, number of channels.
            (0xC0 | 0xC1, &[_, h1, h0, w1, w0, channels, ..]) => {
                let (width, height) = (u16::from_be_bytes([w1, w0]), u16::from_be_bytes([h1, h0]));
                frame = Some((u32::from(width), u32::from(height), channels));
            }
            // Any other one, which are all of C0 to CF but Huffman tables, extensions and arithmetic conditioning.
            (0xC0..=0xC3 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF, _) => return None,
            // Start of scan.
            (0xDA, &[channels, ..]) => {
                let (width, height, all) = frame?;
                let pixels = u64::from(width) * u64::from(height);
                let plain = channels == all && bytes.len() as u64 <= pixels;
                return plain.then_some((width, height));
            }
            (0x01 | 0xD0..=0xDA, _) => return None,
            _ => {}
        }
    }
}
