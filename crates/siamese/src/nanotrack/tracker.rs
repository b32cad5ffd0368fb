//! Backbone and head together, as an expert.

use std::cell::RefCell;

use bagtrack_tracker::{Expert, Frame, Rect, Sighting};
use xxhash_rust::xxh3::xxh3_64;

use super::crop::{self, Square, crop};
use super::decode::{context_side, decode};
use crate::error::ModelError;
use crate::network::memory::Memory;
use crate::network::plan::Plan;
use crate::network::tensor::Tensor;
use crate::onnx::model::Graph;

/// Sides of the pictures of the target and of the search area, in pixels.
const TARGET_PIXELS: usize = 127;
const SEARCH_PIXELS: usize = 255;

thread_local! {
    // The buffers of a run take some megabytes, and mean nothing afterwards.
    static MEMORY: RefCell<Memory> = RefCell::default();
}

/// NanoTrack, version 2 or 3, in the two ONNX files that its authors publish.
///
/// Sessions share one: it takes a megabyte or two, and each look about a hundred million multiplications.
#[derive(Debug)]
pub struct NanoTrack {
    backbone: Plan,
    head: Plan,
    fingerprint: u64,
    /// The shape of the backbone's answer to a picture of the target.
    features: Vec<usize>,
}

impl NanoTrack {
    /// The network in two ONNX files: `backbone` describes pictures, `head` compares two descriptions.
    ///
    /// # Errors
    /// Bytes that are not ONNX, hold operations that are not known here, or are no such networks. Both networks are run
    /// once to find out.
    pub fn from_onnx(backbone: &[u8], head: &[u8]) -> Result<Self, ModelError> {
        let mut network = Self {
            fingerprint: xxh3_64(backbone) ^ xxh3_64(head).rotate_left(1),
            backbone: Plan::new(Graph::parse(backbone)?)?,
            head: Plan::new(Graph::parse(head)?)?,
            features: Vec::new(),
        };
        if network.backbone.arity() != (1, 1) || network.head.arity() != (2, 2) {
            return Err(ModelError::Unexpected(
                "NanoTrack's backbone takes one picture, its head two descriptions, and gives two answers",
            ));
        }
        let blank = |pixels: usize| Tensor {
            shape: vec![1, 3, pixels, pixels],
            values: vec![0.0; 3 * pixels * pixels],
        };
        let described = network.describe(blank(TARGET_PIXELS))?;
        network.features = described.shape.clone();
        let found = network.compare(described, blank(SEARCH_PIXELS))?;
        let place = Rect::new(0.0, 0.0, 64.0, 64.0);
        match &found[..] {
            [classes, edges] if decode([classes, edges], &place, 1.0).is_some() => Ok(network),
            _ => Err(ModelError::Unexpected(
                "its head does not answer with two classes and four edges for each place of a grid",
            )),
        }
    }

    fn describe(&self, picture: Tensor) -> Result<Tensor, ModelError> {
        let run =
            |memory: &RefCell<Memory>| self.backbone.run(vec![picture], &mut memory.borrow_mut());
        let outputs = MEMORY.with(run)?;
        let output = outputs.into_iter().next();
        output.ok_or(ModelError::Unexpected("it answers nothing"))
    }

    /// The head's answers for a target and the picture of a search area.
    fn compare(&self, target: Tensor, search: Tensor) -> Result<Vec<Tensor>, ModelError> {
        let search = self.describe(search)?;
        let run = |memory: &RefCell<Memory>| {
            self.head
                .run(vec![target, search], &mut memory.borrow_mut())
        };
        MEMORY.with(run)
    }
}

impl Expert for NanoTrack {
    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn template_len(&self) -> usize {
        3 + self.features.iter().product::<usize>()
    }

    fn start(&self, frame: &Frame, target: &Rect) -> Vec<f32> {
        let mean = crop::mean(frame);
        let square = Square {
            center: target.center(),
            side: context_side(target.width, target.height),
        };
        let picture = crop(frame, &square, TARGET_PIXELS, mean);
        let described = self.describe(picture);
        let described = described.expect("pictures of this size were tried when it was loaded");
        let values = mean.into_iter().chain(described.values);
        // Weights without bounds could give infinities, which no snapshot may hold.
        values
            .map(|value| if value.is_finite() { value } else { 0.0 })
            .collect()
    }

    fn look(&self, frame: &Frame, template: &[f32], place: &Rect) -> Sighting {
        let (mean, features) = template.split_at(3);
        let context = context_side(place.width, place.height);
        let scale = TARGET_PIXELS as f64 / context;
        let square = Square {
            center: place.center(),
            side: SEARCH_PIXELS as f64 / scale,
        };
        let search = crop(frame, &square, SEARCH_PIXELS, [mean[0], mean[1], mean[2]]);
        let target = Tensor {
            shape: self.features.clone(),
            values: features.to_vec(),
        };
        let found = self.compare(target, search);
        let found = found.expect("pictures of this size were tried when it was loaded");
        let sighting = match &found[..] {
            [classes, edges] => decode([classes, edges], place, scale),
            _ => None,
        };
        let unseen = Sighting {
            target: *place,
            score: 0.0,
        };
        sighting.filter(|it| it.target.is_valid()).unwrap_or(unseen)
    }
}
