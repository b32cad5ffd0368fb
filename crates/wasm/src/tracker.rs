//! The tracker.

use crate::estimate::{WasmEstimate, WasmSeen};
use crate::frame::WasmFrame;
use crate::parameters::WasmParameters;
use bagtrack_tracker::{BagEntry, Rect, Tracker, check_box};
use wasm_bindgen::prelude::*;

/// Follows one object.
#[wasm_bindgen(js_name = Tracker)]
#[derive(Debug)]
pub struct WasmTracker(Tracker);

#[wasm_bindgen(js_class = Tracker)]
impl WasmTracker {
    /// Starts on `frame` with a box in its pixels: x, y, width, height.
    ///
    /// # Errors
    /// A parameter or a box that cannot be used.
    #[wasm_bindgen(constructor)]
    pub fn new(
        frame: &WasmFrame,
        target: &[f64],
        parameters: &WasmParameters,
    ) -> Result<WasmTracker, JsError> {
        let params = parameters.0.clone();
        Ok(Self(Tracker::new(&frame.0, rect(frame, target)?, params)?))
    }

    /// A tracker that goes on from the bytes of `save`, here or elsewhere.
    ///
    /// # Errors
    /// Bytes that are no such snapshot, or are damaged.
    pub fn load(snapshot: &[u8]) -> Result<WasmTracker, JsError> {
        Ok(Self(Tracker::restore(snapshot)?))
    }

    /// The whole state as bytes.
    pub fn save(&self) -> Vec<u8> {
        self.0.snapshot()
    }

    /// Finds the target in the next frame.
    ///
    /// # Errors
    /// A frame of another size than the first one.
    pub fn step(&mut self, frame: &WasmFrame) -> Result<WasmEstimate, JsError> {
        Ok(self.0.step(&frame.0)?.into())
    }

    /// Like `step`, with what the answer was chosen from.
    ///
    /// # Errors
    /// As for `step`.
    pub fn see(&mut self, frame: &WasmFrame) -> Result<WasmSeen, JsError> {
        let (estimate, seen) = self.0.step_with_diagnostics(&frame.0)?;
        Ok(WasmSeen::new(estimate, seen))
    }

    /// Takes `frame` as the next one, with the right box in it.
    ///
    /// # Errors
    /// As for `step` and `new`.
    pub fn correct(&mut self, frame: &WasmFrame, target: &[f64]) -> Result<WasmEstimate, JsError> {
        Ok(self.0.retarget(&frame.0, rect(frame, target)?)?.into())
    }

    /// The last answer.
    #[wasm_bindgen(getter)]
    pub fn estimate(&self) -> WasmEstimate {
        self.0.estimate().into()
    }

    /// Width and height of the frames.
    #[wasm_bindgen(getter)]
    pub fn size(&self) -> Vec<u32> {
        let (width, height) = self.0.source_size();
        vec![width, height]
    }

    /// Its parameters.
    #[wasm_bindgen(getter)]
    pub fn parameters(&self) -> WasmParameters {
        WasmParameters(self.0.params().clone())
    }

    /// What the tracker keeps of the target: for each entry of the bag, oldest first, the gray values of its mean and
    /// of the columns of its basis, each row by row.
    #[wasm_bindgen(getter)]
    pub fn bag(&self) -> Vec<WasmEntry> {
        let entries = self.0.bag().into_iter();
        entries.map(WasmEntry::new).collect()
    }
}

/// An affine subspace of the bag, as pictures.
#[wasm_bindgen(js_name = Entry, getter_with_clone)]
#[derive(Debug, Clone)]
pub struct WasmEntry {
    /// Cells across.
    pub columns: u32,
    /// The values of the mean, then those of the columns of the basis.
    pub values: Vec<f32>,
}

impl WasmEntry {
    fn new(BagEntry { mean, basis }: BagEntry) -> Self {
        let columns = mean.columns;
        let vectors = std::iter::once(mean).chain(basis);
        Self {
            columns,
            values: vectors.flat_map(|vector| vector.gray).collect(),
        }
    }
}

fn rect(frame: &WasmFrame, values: &[f64]) -> Result<Rect, JsError> {
    let [x, y, width, height] = *values else {
        return Err(JsError::new("a box has four numbers"));
    };
    let target = Rect::new(x, y, width, height);
    check_box(&target, frame.0.source_size())?;
    Ok(target)
}
