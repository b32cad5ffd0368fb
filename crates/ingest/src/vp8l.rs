//! How much memory the prefix codes of a lossless WebP (VP8L, RFC 9649) take.
//!
//! Such an image may have up to 65,536 groups of five codes. A group of some bytes can describe codes for which the
//! decoder allocates a hundred kilobytes, and no header tells how many groups there are. So the file is read up to its
//! last code: the small images before the pixels are walked through, and no pixel is kept.
//!
//! Nothing simpler bounds it. image-webp 0.2.4 allocates every group up to the largest number that stands in the small
//! image of groups, whether a pixel uses it or not, so the number of pixels is no bound; its `set_memory_limit` is
//! asked for metadata only (docs/upstream/image-webp.md). A bound by pixels that holds would be that of 65,536 groups,
//! whatever the image.

use super::prefix_codes::{Bits, Code};

/// Bytes for a group besides its codes: the codes' headers, in a list that doubles as it grows.
const GROUP: u64 = 1 << 10;
/// Symbols of the five codes; colours that were seen before are symbols of the first, too.
const ALPHABETS: [usize; 5] = [256 + 24, 256, 256, 256, 40];
const FIRST_LENGTH: u16 = 256;
const FIRST_SEEN_COLOR: u16 = FIRST_LENGTH + 24;
const SIGNATURE: usize = 0x2f;

/// Bytes that the codes of the image in a `VP8L` chunk take: exact, or some number above `most`. `None` where the codes
/// cannot be read, or the image has another size. An unchecked size would let the sender choose how long the walk
/// through the image takes.
pub(super) fn memory_of_codes(data: &[u8], size: (usize, usize), most: u64) -> Option<u64> {
    let mut bits = Bits::new(data);
    if bits.number(8)? != SIGNATURE {
        return None;
    }
    if size != (1 + bits.number(14)?, 1 + bits.number(14)?) {
        return None;
    }
    // The bit for alpha, and the version.
    bits.number(4)?;
    walk(&mut bits, size, most)
}

/// Bytes that the codes of the alpha channel in an `ALPH` chunk take, for an image of this size; as in
/// [`memory_of_codes`].
pub(super) fn memory_of_alpha_codes(data: &[u8], size: (usize, usize), most: u64) -> Option<u64> {
    let (header, data) = data.split_first()?;
    match header & 3 {
        1 => walk(&mut Bits::new(data), size, most),
        _ => Some(0),
    }
}

/// Walks through an image up to the last code of its pixels, or until the codes take more than `most` bytes.
fn walk(bits: &mut Bits, (mut width, height): (usize, usize), most: u64) -> Option<u64> {
    let mut seen = [false; 4];
    while bits.bit()? == 1 {
        let kind = bits.number(2)?;
        if std::mem::replace(&mut seen[kind], true) {
            return None;
        }
        match kind {
            // Predictors and colour transforms, one for each block.
            0 | 1 => {
                let block = 2 + bits.number(3)?;
                read_pixels(bits, blocks(width, block), blocks(height, block))?;
            }
            // Green was subtracted.
            2 => {}
            // A palette, whose indices share pixels.
            _ => {
                let colors = 1 + bits.number(8)?;
                read_pixels(bits, colors, 1)?;
                width = match colors {
                    1..=2 => blocks(width, 3),
                    3..=4 => blocks(width, 2),
                    5..=16 => blocks(width, 1),
                    _ => width,
                };
            }
        }
    }
    let seen_colors = read_seen_colors(bits)?;
    let mut groups = 1;
    if bits.bit()? == 1 {
        let block = 2 + bits.number(3)?;
        groups += read_pixels(bits, blocks(width, block), blocks(height, block))?;
    }
    let mut memory = 0;
    for _ in 0..groups {
        let codes = read_group(bits, seen_colors)?;
        memory += GROUP + codes.iter().map(Code::memory).sum::<u64>();
        if memory > most {
            break;
        }
    }
    Some(memory)
}

/// How many blocks of 2^`bits` pixels cover a side.
fn blocks(side: usize, bits: usize) -> usize {
    side.div_ceil(1 << bits)
}

/// The size of the cache of colours that were seen before; 0 without one.
fn read_seen_colors(bits: &mut Bits) -> Option<usize> {
    match bits.bit()? {
        0 => Some(0),
        _ => match bits.number(4)? {
            size @ 1..=11 => Some(1 << size),
            _ => None,
        },
    }
}

fn read_group(bits: &mut Bits, seen_colors: usize) -> Option<[Code; 5]> {
    let [green, red, blue, alpha, distance] = ALPHABETS;
    Some([
        Code::read(bits, green + seen_colors)?,
        Code::read(bits, red)?,
        Code::read(bits, blue)?,
        Code::read(bits, alpha)?,
        Code::read(bits, distance)?,
    ])
}

/// Reads an image with one group of codes. Returns the largest number in the red and green of its pixels. Copied pixels
/// repeat earlier ones, so they are not looked at.
fn read_pixels(bits: &mut Bits, width: usize, height: usize) -> Option<usize> {
    let seen_colors = read_seen_colors(bits)?;
    let codes = read_group(bits, seen_colors)?;
    let (mut left, mut largest) = (width * height, 0);
    while left > 0 {
        let [green, red, blue, alpha, distance] = &codes;
        let symbol = green.symbol(bits)?;
        let count = match symbol {
            ..FIRST_LENGTH => {
                let number = usize::from(red.symbol(bits)?) << 8 | usize::from(symbol);
                blue.symbol(bits)?;
                alpha.symbol(bits)?;
                largest = largest.max(number);
                1
            }
            FIRST_LENGTH..FIRST_SEEN_COLOR => {
                let length = read_count(bits, usize::from(symbol - FIRST_LENGTH))?;
                let code = distance.symbol(bits)?;
                read_count(bits, usize::from(code))?;
                length
            }
            _ => 1,
        };
        left = left.checked_sub(count)?;
    }
    Some(largest)
}

/// A length or a distance: a code for its size, then its lower bits.
fn read_count(bits: &mut Bits, code: usize) -> Option<usize> {
    if code < 4 {
        return Some(code + 1);
    }
    let extra = (code - 2) >> 1;
    let offset = (2 + (code & 1)) << extra;
    Some(offset + bits.number(extra)? + 1)
}
