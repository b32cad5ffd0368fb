//! A frame, which several trackers may look at.

use bagtrack_tracker::{Frame, FrameError};
use wasm_bindgen::prelude::*;

/// A frame of a video.
#[wasm_bindgen(js_name = Frame)]
#[derive(Debug)]
pub struct WasmFrame(pub(crate) Frame);

#[wasm_bindgen(js_class = Frame)]
impl WasmFrame {
    /// A frame of `width` x `height` RGBA pixels row by row, as in `ImageData`. What is transparent is blended over
    /// black.
    ///
    /// # Errors
    /// A side of 0, or a number of bytes that is not `4 * width * height`.
    #[wasm_bindgen(js_name = fromRgba)]
    pub fn from_rgba(width: u32, height: u32, rgba: &[u8]) -> Result<WasmFrame, JsError> {
        let is_opaque = |pixel: &[u8; 4]| pixel[3] == 255;
        // Frames of videos have no transparent pixels and need no copy.
        if rgba.as_chunks::<4>().0.iter().all(is_opaque) {
            return made(Frame::from_rgbx(width, height, rgba));
        }
        let mut blended = rgba.to_vec();
        blended.as_chunks_mut().0.iter_mut().for_each(over_black);
        made(Frame::from_rgbx(width, height, &blended))
    }

    /// A frame of planes, as JPEG has them (Rec. 601, full range): `width` x `height` values of luma and, where there
    /// is colour, Cb and Cr in half of the columns and rows, rounded up.
    ///
    /// # Errors
    /// A side of 0, or a plane of another size.
    #[wasm_bindgen(js_name = fromPlanes)]
    pub fn from_planes(
        width: u32,
        height: u32,
        luma: Vec<u8>,
        cb: Option<Vec<u8>>,
        cr: Option<Vec<u8>>,
    ) -> Result<WasmFrame, JsError> {
        let chroma = cb.zip(cr).map(|(cb, cr)| [cb, cr]);
        let size = (width, height);
        made(Frame::from_reduced(size, size, luma, chroma))
    }
}

fn made(frame: Result<Frame, FrameError>) -> Result<WasmFrame, JsError> {
    Ok(WasmFrame(frame?))
}

/// Blends a pixel over black.
fn over_black([red, green, blue, alpha]: &mut [u8; 4]) {
    for value in [red, green, blue] {
        *value = ((u32::from(*value) * u32::from(*alpha) + 127) / 255) as u8;
    }
}
