//! Small letters of 8 x 8 pixels.

use font8x8::legacy::BASIC_LEGACY;

/// Width of a letter in pixels.
pub(super) const WIDTH: u32 = 8;
/// Height of a letter in pixels.
pub(super) const HEIGHT: u32 = 8;

/// Whether a letter of `text`, which is ASCII in one line, covers this pixel.
pub(super) fn is_ink(text: &str, x: u32, y: u32) -> bool {
    let letter = text.as_bytes().get((x / WIDTH) as usize);
    let rows = letter.and_then(|letter| BASIC_LEGACY.get(usize::from(*letter)));
    let row = rows.and_then(|rows| rows.get(y as usize));
    row.is_some_and(|row| row >> (x % WIDTH) & 1 == 1)
}
