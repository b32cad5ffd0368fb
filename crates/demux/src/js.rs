//! The index for JavaScript, of a file that is read by a function.

use crate::{DemuxError, Index, Sample};
use js_sys::{Function, Uint8Array};
use std::io::{self, Read, Seek, SeekFrom};
use wasm_bindgen::prelude::*;

/// [`Index`] for JavaScript.
#[wasm_bindgen(js_name = Index)]
#[derive(Debug)]
pub struct JsIndex(Index);

/// The index of a file with `size` bytes, of which `read(offset, length)` gives a `Uint8Array`.
///
/// # Errors
/// [`DemuxError`]: for a file that has no index which can be relied on.
#[wasm_bindgen(js_name = index)]
pub fn js_index(read: Function, size: f64) -> Result<JsIndex, JsError> {
    let file = File {
        read,
        size: size as u64,
        position: 0,
    };
    let index: Result<Index, DemuxError> = crate::index(file);
    Ok(JsIndex(index?))
}

#[wasm_bindgen(js_class = Index)]
impl JsIndex {
    /// As `codec` of a `VideoDecoderConfig`.
    #[wasm_bindgen(getter)]
    pub fn codec(&self) -> String {
        self.0.codec.clone()
    }

    /// As `description` of one.
    #[wasm_bindgen(getter)]
    pub fn description(&self) -> Option<Vec<u8>> {
        self.0.description.clone()
    }

    /// Degrees clockwise.
    #[wasm_bindgen(getter)]
    pub fn rotation(&self) -> u16 {
        self.0.rotation
    }

    /// Where each sample begins, in the order of decoding.
    #[wasm_bindgen(getter)]
    pub fn offsets(&self) -> Vec<f64> {
        self.of(|sample| sample.offset as f64)
    }

    /// The bytes of each.
    #[wasm_bindgen(getter)]
    pub fn sizes(&self) -> Vec<u32> {
        self.of(|sample| sample.size)
    }

    /// When each is shown, in microseconds.
    #[wasm_bindgen(getter)]
    pub fn times(&self) -> Vec<f64> {
        self.of(|sample| sample.time as f64)
    }

    /// For each 1 where it needs no other one, else 0.
    #[wasm_bindgen(getter)]
    pub fn keys(&self) -> Vec<u8> {
        self.of(|sample| sample.is_key.into())
    }

    /// For each 1 where it is shown, else 0.
    #[wasm_bindgen(getter)]
    pub fn shown(&self) -> Vec<u8> {
        self.of(|sample| sample.is_shown.into())
    }
}

impl JsIndex {
    fn of<T>(&self, value: impl Fn(&Sample) -> T) -> Vec<T> {
        self.0.samples.iter().map(value).collect()
    }
}

struct File {
    read: Function,
    size: u64,
    position: u64,
}

impl Read for File {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.size.saturating_sub(self.position);
        let length = usize::try_from(left).map_or(buffer.len(), |left| left.min(buffer.len()));
        let (offset, asked) = ((self.position as f64).into(), (length as f64).into());
        let failed = |_| io::Error::other("the file cannot be read");
        let bytes = self
            .read
            .call2(&JsValue::NULL, &offset, &asked)
            .map_err(failed)?;
        let bytes: Uint8Array = bytes.dyn_into().map_err(failed)?;
        let length = length.min(bytes.length() as usize);
        bytes.slice(0, length as u32).copy_to(&mut buffer[..length]);
        self.position += length as u64;
        Ok(length)
    }
}

impl Seek for File {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(offset) => Some(offset),
            SeekFrom::End(by) => self.size.checked_add_signed(by),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}
