//! The bag as a contact sheet.

use bagtrack_tracker::{BagEntry, VectorView};
use image::{ImageFormat, ImageResult, Rgb, RgbImage};
use std::io::Cursor;

/// Longest side of a vector's picture in pixels.
const TILE: u32 = 64;
const GAP: u32 = 4;
const GROUND: Rgb<u8> = Rgb([24, 25, 28]);

/// The pictures of the vectors of a bag: a row for each entry.
#[derive(Debug)]
pub struct ContactSheet {
    rows: Vec<Vec<RgbImage>>,
}

impl ContactSheet {
    /// The contact sheet of these entries.
    pub fn of(bag: &[BagEntry]) -> Self {
        Self {
            rows: bag.iter().map(tiles).collect(),
        }
    }

    /// Width and height of a picture, with the gap after it.
    fn step(&self) -> (u32, u32) {
        let tile = self.rows.iter().flatten().next();
        let (width, height) = tile.map_or((1, 1), RgbImage::dimensions);
        (width + GAP, height + GAP)
    }

    fn size(&self) -> (u32, u32) {
        let across = self.rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
        let (step_x, step_y) = self.step();
        (GAP + across * step_x, GAP + self.rows.len() as u32 * step_y)
    }

    /// Bytes of the sheet's pixels. The PNG file takes hardly more.
    pub fn bytes(&self) -> usize {
        let (width, height) = self.size();
        3 * width as usize * height as usize
    }

    /// The sheet as a PNG file.
    ///
    /// # Errors
    /// The sheet cannot be encoded.
    pub fn png(&self) -> ImageResult<Vec<u8>> {
        let (width, height) = self.size();
        let (step_x, step_y) = self.step();
        let mut sheet = RgbImage::from_pixel(width, height, GROUND);
        for (y, row) in self.rows.iter().enumerate() {
            for (x, tile) in row.iter().enumerate() {
                let (x, y) = (GAP + x as u32 * step_x, GAP + y as u32 * step_y);
                image::imageops::replace(&mut sheet, tile, x.into(), y.into());
            }
        }
        let mut bytes = Cursor::new(Vec::new());
        sheet.write_to(&mut bytes, ImageFormat::Png)?;
        Ok(bytes.into_inner())
    }
}

/// The pictures of an entry.
fn tiles(entry: &BagEntry) -> Vec<RgbImage> {
    let mut tiles = Vec::new();
    for (vector, is_mean) in
        std::iter::once((&entry.mean, true)).chain(entry.basis.iter().map(|column| (column, false)))
    {
        let chroma = vector.chroma.as_ref().filter(|_| is_mean);
        tiles.push(tile(vector, &vector.gray, chroma));
        if let Some(gradient) = &vector.gradient {
            tiles.push(tile(vector, gradient, None));
        }
    }
    tiles
}

/// One square of gray for each value, from the least to the greatest, tinted by the chroma where there is any. With
/// negative values, 0 is medium gray.
fn tile(vector: &VectorView, values: &[f32], chroma: Option<&[Vec<f32>; 2]>) -> RgbImage {
    let least = values.iter().copied().fold(f32::INFINITY, f32::min);
    let most = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let (low, high) = match least < 0.0 {
        true => (-least.abs().max(most.abs()), least.abs().max(most.abs())),
        false => (least, most),
    };
    let range = (high - low).max(f32::MIN_POSITIVE);
    let most_chroma = chroma.into_iter().flatten().flatten();
    let most_chroma = most_chroma.fold(f32::MIN_POSITIVE, |most, value| most.max(value.abs()));
    let side = (TILE / vector.columns.max(vector.rows)).max(1);
    RgbImage::from_fn(vector.columns * side, vector.rows * side, |x, y| {
        let cell = (y / side * vector.columns + x / side) as usize;
        let gray = 255.0 * (values[cell] - low) / range;
        let [blue, red] = match chroma {
            Some([blue, red]) => [blue[cell], red[cell]].map(|value| 60.0 * value / most_chroma),
            None => [0.0; 2],
        };
        // YCbCr to RGB by BT.601 in full range.
        let color = [
            gray + 1.402 * red,
            gray - 0.344 * blue - 0.714 * red,
            gray + 1.772 * blue,
        ];
        Rgb(color.map(|value| value.round().clamp(0.0, 255.0) as u8))
    })
}
