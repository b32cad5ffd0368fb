//! The chunk structure of WebP, read before decoding: whether the file is whole, and what decoding it takes. The
//! decoder would not notice a missing end, or would allocate as many bytes as a chunk claims.
//!
//! Only what image-webp 0.2.4 decodes counts: of a simple file the first chunk; of an extended file the first chunk of
//! each kind, or the first frame of the animation. The size in an image's own header has to be that of the canvas or
//! frame: the decoder compares them too, but only after decoding.

use super::png_chunks::CUT_SHORT;
use super::vp8l;

/// Bytes of a chunk before its data, and of an animation's frame before its chunks.
const HEADER: usize = 8;
const FRAME_HEADER: usize = 16;
/// The bit of an animation in the first byte of `VP8X`.
const ANIMATION: u8 = 1 << 1;
/// These bytes follow the three bytes of a lossy key frame's tag, before its size.
const START_CODE: [u8; 3] = [0x9d, 0x01, 0x2a];

/// Width and height.
type Size = (usize, usize);

/// The images of a WebP, from which the memory of decoding besides the output follows.
#[derive(Debug)]
pub(super) struct WebP<'a> {
    /// The file without bytes after its end.
    pub(super) file: &'a [u8],
    still: Images<'a>,
    /// The images of the first frame of an animation.
    frame: Option<Images<'a>>,
}

/// The chunks of an image: `VP8 `, `VP8L` and `ALPH`.
#[derive(Debug, Default)]
struct Images<'a> {
    lossy: Option<&'a [u8]>,
    lossless: Option<&'a [u8]>,
    alpha: Option<&'a [u8]>,
    /// Their size, where it is not that of the canvas.
    size: Option<Size>,
}

impl<'a> WebP<'a> {
    /// Walks the chunks of a WebP up to the length that its RIFF header notes.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, &'static str> {
        let end = length_at(bytes, 4).and_then(|riff| riff.checked_add(HEADER));
        let file = bytes.get(..end.ok_or(CUT_SHORT)?).ok_or(CUT_SHORT)?;
        let (mut still, mut frame) = (Images::default(), None);
        // The flags of an extended file.
        let mut extended = None;
        for (index, chunk) in chunks(file, 12).enumerate() {
            let (kind, data) = chunk?;
            match (index, extended) {
                (0, _) if kind == b"VP8X" => extended = Some(*data.first().ok_or(CUT_SHORT)?),
                (0, _) => still.add(kind, data),
                (_, Some(flags)) if kind == b"ANMF" => {
                    frame.get_or_insert_with(|| Images::of_frame(data, flags & ANIMATION != 0));
                }
                (_, Some(_)) => still.add(kind, data),
                (_, None) => {}
            }
        }
        Ok(Self { file, still, frame })
    }

    /// Bytes a pixel that the decoder allocates beside its output. Lossless: the image in RGBA, and what its transforms
    /// read. Lossy: three planes, and where it has an alpha channel that channel by itself, as a lossless image. An
    /// animation has its canvas besides, and its first image in RGBA, which may be of either kind.
    pub(super) fn working_bytes_per_pixel(&self) -> u64 {
        let is_animated = self.frame.is_some();
        let has_alpha = is_animated || self.still.alpha.is_some();
        let is_lossless = is_animated || self.still.lossless.is_some();
        let lossy = 2 + if has_alpha { 7 } else { 0 };
        let still = lossy.max(if is_lossless { 6 } else { 0 });
        still + if is_animated { 8 } else { 0 }
    }

    /// Bytes that the prefix codes of its lossless parts take, in an image of this size: exact, or some number above
    /// `most`. `None` where the codes cannot be read, or an image has another size.
    pub(super) fn memory_of_codes(&self, (width, height): (u32, u32), most: u64) -> Option<u64> {
        let canvas = (width as usize, height as usize);
        let all = std::iter::once(&self.still).chain(&self.frame);
        // The images are decoded one after the other, so the largest counts.
        all.map(|images| images.memory_of_codes(canvas, most))
            .try_fold(0, |largest, memory| Some(memory?.max(largest)))
    }
}

impl<'a> Images<'a> {
    /// Notes a chunk, unless there was one of its kind.
    fn add(&mut self, kind: &[u8], data: &'a [u8]) {
        let place = match kind {
            b"VP8 " => &mut self.lossy,
            b"VP8L" => &mut self.lossless,
            b"ALPH" => &mut self.alpha,
            _ => return,
        };
        place.get_or_insert(data);
    }

    /// The chunks of an image in an `ANMF` chunk: the first and, after an alpha channel, the next whatever its name.
    /// Where the file is no animation, the decoder takes them as chunks of the file of their kinds.
    fn of_frame(data: &'a [u8], is_animation: bool) -> Self {
        let side = |at: usize| {
            let [low, middle, high] = *data.get(at..)?.first_chunk()?;
            Some(1 + u32::from_le_bytes([low, middle, high, 0]) as usize)
        };
        let mut images = Self {
            size: side(6).zip(side(9)).filter(|_| is_animation),
            ..Self::default()
        };
        for (kind, data) in chunks(data, FRAME_HEADER).flatten().take(2) {
            let is_after_alpha = is_animation && images.alpha.is_some();
            images.add(if is_after_alpha { b"VP8 " } else { kind }, data);
        }
        images
    }

    fn memory_of_codes(&self, canvas: Size, most: u64) -> Option<u64> {
        let size = self.size.unwrap_or(canvas);
        let is_inside = size.0 <= canvas.0 && size.1 <= canvas.1;
        let is_lossy_of_size = self.lossy.is_none_or(|data| lossy_size(data) == Some(size));
        if !is_inside || !is_lossy_of_size {
            return None;
        }
        let of_image = |data| vp8l::memory_of_codes(data, size, most);
        let of_alpha = |data| vp8l::memory_of_alpha_codes(data, size, most);
        let image = self.lossless.map_or(Some(0), of_image)?;
        let alpha = self.alpha.map_or(Some(0), of_alpha)?;
        Some(image.max(alpha))
    }
}

/// The size of a lossy image (RFC 6386, section 9.1).
fn lossy_size(data: &[u8]) -> Option<Size> {
    let [a, b, c, width_low, width_high, height_low, height_high] =
        *data.get(3..)?.first_chunk()?;
    let side = |bytes| usize::from(u16::from_le_bytes(bytes) & 0x3fff);
    let size = (
        side([width_low, width_high]),
        side([height_low, height_high]),
    );
    ([a, b, c] == START_CODE).then_some(size)
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
