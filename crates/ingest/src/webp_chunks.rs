//! The chunk structure of WebP, read before decoding: whether the file is whole, and what decoding it takes. The decoder
//! would not notice a missing end, or would allocate as many bytes as a chunk claims.

use super::png_chunks::CUT_SHORT;
use super::vp8l;

/// Bytes of a chunk before its data, and of an animation's frame before its chunks.
const HEADER: usize = 8;
const FRAME_HEADER: usize = 16;

/// Width and height.
type Size = (usize, usize);

/// What decoding a WebP takes beside its output.
#[derive(Debug, Default)]
pub(super) struct WebP<'a> {
    lossless: bool,
    alpha: bool,
    animated: bool,
    /// The data of `VP8L` chunks, and of `ALPH` chunks with the size of their frame where that is not the canvas.
    images: Vec<&'a [u8]>,
    alphas: Vec<(&'a [u8], Option<Size>)>,
}

impl<'a> WebP<'a> {
    /// Walks the chunks of a WebP up to the length that its RIFF header notes.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, &'static str> {
        let end = length_at(bytes, 4).and_then(|riff| riff.checked_add(HEADER));
        let file = bytes.get(..end.ok_or(CUT_SHORT)?).ok_or(CUT_SHORT)?;
        let mut webp = Self::default();
        for chunk in chunks(file, 12) {
            let (kind, data) = chunk?;
            webp.add(kind, data, None);
        }
        Ok(webp)
    }

    fn add(&mut self, kind: &[u8], data: &'a [u8], frame: Option<Size>) {
        match kind {
            b"VP8L" => {
                self.lossless = true;
                self.images.push(data);
            }
            b"ALPH" => {
                self.alpha = true;
                self.alphas.push((data, frame));
            }
            // The first frame is what is decoded.
            b"ANMF" if !self.animated => {
                let side = |at: usize| {
                    let [low, middle, high] = *data.get(at..)?.first_chunk()?;
                    Some(1 + u32::from_le_bytes([low, middle, high, 0]) as usize)
                };
                let frame = side(6).zip(side(9));
                for (kind, data) in chunks(data, FRAME_HEADER).flatten() {
                    self.add(kind, data, frame);
                }
                // Its image may be of either kind.
                (self.lossless, self.alpha, self.animated) = (true, true, true);
            }
            _ => {}
        }
    }

    /// Bytes a pixel that the decoder allocates beside its output. Lossless: the image in RGBA, and what its transforms
    /// read. Lossy: three planes, and where it has an alpha channel that channel by itself, as a lossless image. An
    /// animation has its canvas besides, and its first image in RGBA.
    pub(super) fn working_bytes_per_pixel(&self) -> u64 {
        let lossy = 2 + if self.alpha { 7 } else { 0 };
        let still = lossy.max(if self.lossless { 6 } else { 0 });
        still + if self.animated { 8 } else { 0 }
    }

    /// Bytes that the prefix codes of its lossless parts take, in an image of this size; none, where they cannot be read.
    pub(super) fn memory_of_codes(&self, (width, height): (u32, u32)) -> Option<u64> {
        let canvas = (width as usize, height as usize);
        let images = self.images.iter().map(|data| vp8l::memory_of_codes(data));
        let alphas = self
            .alphas
            .iter()
            .map(|(data, frame)| vp8l::memory_of_alpha_codes(data, frame.unwrap_or(canvas)));
        // One after the other is decoded.
        images
            .chain(alphas)
            .try_fold(0, |most, memory| Some(memory?.max(most)))
    }
}

/// The chunks from `at` on: their names and their data.
fn chunks(
    bytes: &[u8],
    mut at: usize,
) -> impl Iterator<Item = Result<(&[u8], &[u8]), &'static str>> {
    std::iter::from_fn(move || {
        if at >= bytes.len() {
            return None;
        }
        let data = length_at(bytes, at + 4).and_then(|length| {
            let start = at + HEADER;
            let data = bytes.get(start..start.checked_add(length)?)?;
            Some((&bytes[at..at + 4], data))
        });
        at = match data {
            Some((_, data)) => at + HEADER + data.len() + data.len() % 2,
            None => bytes.len(),
        };
        Some(data.ok_or(CUT_SHORT))
    })
}

fn length_at(bytes: &[u8], at: usize) -> Option<usize> {
    let field: &[u8; 4] = bytes.get(at..)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*field)).ok()
}
