//! The chunk structure of PNG, read before decoding: whether the file is whole, and what decoding needs of it.

use std::borrow::Cow;
use std::ops::Range;

/// The reason for a file that ends before its end marker.
pub(super) const CUT_SHORT: &str = "it is cut short";

/// The chunks that pixels and their orientation depend on. Others are left out before decoding: a colour profile or a
/// text of a few hundred kilobytes may unpack to hundreds of megabytes.
const PNG_CHUNKS: [&[u8; 4]; 6] = [b"IHDR", b"PLTE", b"tRNS", b"eXIf", b"IDAT", b"IEND"];

/// A PNG whose chunks were read up to `IEND`.
pub(super) struct Png<'a> {
    bytes: &'a [u8],
    /// Width and height as stored.
    pub(super) size: (u32, u32),
    /// The EXIF block, where one stands before the pixels.
    pub(super) exif: Option<&'a [u8]>,
    /// The ranges of the chunks that decoding needs; adjacent ones are joined.
    needed: Vec<Range<usize>>,
    has_others: bool,
}

impl<'a> Png<'a> {
    /// Walks the chunks.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, &'static str> {
        let mut png = Self {
            bytes,
            size: (0, 0),
            exif: None,
            needed: Vec::new(),
            has_others: false,
        };
        let (mut at, mut saw_pixels) = (8, false);
        loop {
            let header: &[u8; 8] = bytes
                .get(at..)
                .and_then(<[u8]>::first_chunk)
                .ok_or(CUT_SHORT)?;
            let [l3, l2, l1, l0, kind @ ..] = *header;
            let length = u32::from_be_bytes([l3, l2, l1, l0]) as usize;
            // 8 bytes of header before the data, 4 of checksum after it.
            let end = at.checked_add(length + 12).ok_or(CUT_SHORT)?;
            let data = bytes.get(at + 8..end - 4).ok_or(CUT_SHORT)?;
            if end > bytes.len() {
                return Err(CUT_SHORT);
            }
            match &kind {
                b"IHDR" => {
                    let sides = data.first_chunk().ok_or("its header is too short")?;
                    let [w3, w2, w1, w0, h3, h2, h1, h0] = *sides;
                    let side = u32::from_be_bytes;
                    png.size = (side([w3, w2, w1, w0]), side([h3, h2, h1, h0]));
                    if png.size.0 == 0 || png.size.1 == 0 {
                        return Err("its width or its height is 0");
                    }
                }
                b"IDAT" => saw_pixels = true,
                b"eXIf" if !saw_pixels => png.exif = png.exif.or(Some(data)),
                _ => {}
            }
            png.add(&kind, at..end);
            if &kind == b"IEND" {
                let has_header = png.size != (0, 0);
                return has_header.then_some(png).ok_or("it has no header");
            }
            at = end;
        }
    }

    fn add(&mut self, kind: &[u8; 4], chunk: Range<usize>) {
        if !PNG_CHUNKS.contains(&kind) {
            self.has_others = true;
            return;
        }
        match self.needed.last_mut() {
            Some(last) if last.end == chunk.start => last.end = chunk.end,
            _ => self.needed.push(chunk),
        }
    }

    /// The file with the chunks that decoding needs, and no others.
    pub(super) fn without_side_chunks(&self) -> Cow<'a, [u8]> {
        if !self.has_others {
            return Cow::Borrowed(self.bytes);
        }
        let mut kept = self.bytes[..8].to_vec();
        for chunk in &self.needed {
            kept.extend_from_slice(&self.bytes[chunk.clone()]);
        }
        Cow::Owned(kept)
    }
}
