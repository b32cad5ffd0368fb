//! What CVAT sends to a tracker, and what it gets: shapes as the corners of rectangles, and a state for each.

use crate::http::extract::base64_file;
use crate::http::problems::problem::Problem;
use crate::tracker::Rect;
use arrayvec::ArrayVec;
use axum::body::Bytes;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use utoipa::openapi::schema::{Array, ArrayBuilder, ObjectBuilder, SchemaType, Type};

/// Most shapes of a request.
pub const MAX_SHAPES: usize = 100;

/// Left, top, right, bottom, in pixels; two opposite corners in any order.
pub type Corners = [f64; 4];

/// Shapes in the OpenAPI document. Generators do not know what to do with a named type that is an array or null.
fn shapes(which: &str, what: &str) -> Array {
    let corners = ArrayBuilder::new()
        .schema_type(SchemaType::from_iter([Type::Array, Type::Null]))
        .items(ObjectBuilder::new().schema_type(Type::Number))
        .min_items(Some(4))
        .max_items(Some(4))
        .description(Some(what));
    let shapes = ArrayBuilder::new().items(corners).description(Some(which));
    shapes.max_items(Some(MAX_SHAPES)).build()
}

fn asked_shapes() -> Array {
    shapes(
        "Where the targets are that have no state yet; what stands beside a state is not looked at.",
        "Left, top, right and bottom in pixels, or two other opposite corners.",
    )
}

fn found_shapes() -> Array {
    shapes(
        "Where the targets are, in the order of the request.",
        "Left, top, right and bottom in pixels. Null where the target is lost.",
    )
}

/// A request of CVAT; what else it sends does not matter here.
#[derive(Debug, Deserialize, utoipa::ToSchema)]
pub struct CvatRequest<'a> {
    /// The frame: a JPEG, PNG or WebP file as base64.
    #[serde(borrow)]
    #[schema(value_type = String, content_encoding = "base64")]
    image: Cow<'a, str>,
    #[serde(default)]
    #[schema(schema_with = asked_shapes)]
    shapes: ArrayVec<Option<Corners>, MAX_SHAPES>,
    /// The states of the answer to the frame before.
    #[serde(borrow, default)]
    #[schema(value_type = Vec<Option<String>>, max_items = 100)]
    states: ArrayVec<Option<Cow<'a, str>>, MAX_SHAPES>,
}

/// The answer to CVAT, in the order of the request.
#[derive(Debug, Default, Serialize, utoipa::ToSchema)]
pub struct CvatAnswer {
    #[schema(schema_with = found_shapes)]
    shapes: Vec<Option<Corners>>,
    /// What goes with the next frame: signed snapshots as base64.
    states: Vec<String>,
}

/// One target of a request.
#[derive(Debug)]
pub enum Target {
    /// A track begins with this box.
    New(Rect),
    /// A track goes on from this snapshot.
    Known(Bytes),
}

/// A request, read.
#[derive(Debug)]
pub struct Targets {
    /// The file of the frame.
    pub file: Bytes,
    /// At least one.
    pub targets: Vec<Target>,
}

impl Targets {
    /// Reads the body of a request.
    ///
    /// # Errors
    /// It is no request for a tracker, or a shape has neither corners nor a state.
    pub fn read(body: &[u8]) -> Result<Self, Problem> {
        let request: CvatRequest = serde_json::from_slice(body).map_err(|error| {
            let detail = format!("The body is no request of CVAT to a tracker: {error}.");
            Problem::malformed(detail)
        })?;
        let (shapes, states) = (&request.shapes[..], &request.states[..]);
        let count = shapes.len().max(states.len());
        let target = |index: usize| match (states.get(index), shapes.get(index)) {
            (Some(Some(state)), _) => base64_file::decode(state).map(Target::Known),
            (_, Some(Some(corners))) => Ok(Target::New(rect(*corners))),
            _ => Err(Problem::malformed("It has neither a shape nor a state.")),
        };
        let target = |index| target(index).map_err(|problem| problem.of_target(index, count));
        let targets: Vec<Target> = (0..count).map(target).collect::<Result<_, _>>()?;
        let file = base64_file::decode(&request.image)?;
        match (targets.is_empty(), file.is_empty()) {
            (false, false) => Ok(Self { file, targets }),
            (true, _) => Err(Problem::malformed("`shapes` and `states` are empty.")),
            (_, true) => Err(Problem::malformed("`image` is empty.")),
        }
    }
}

impl CvatAnswer {
    /// Adds a target: its box, or none where it is lost, and its snapshot.
    pub fn push(&mut self, found: Option<Rect>, snapshot: &[u8]) {
        self.shapes.push(found.map(corners));
        self.states.push(STANDARD.encode(snapshot));
    }
}

fn rect([x, y, other_x, other_y]: Corners) -> Rect {
    let (width, height) = ((other_x - x).abs(), (other_y - y).abs());
    Rect::new(x.min(other_x), y.min(other_y), width, height)
}

/// To a hundredth of a pixel, as boxes are answered.
fn corners(rect: Rect) -> Corners {
    let (right, bottom) = (rect.x + rect.width, rect.y + rect.height);
    // A negative zero becomes a positive one.
    [rect.x, rect.y, right, bottom].map(|value| (value * 100.0).round() / 100.0 + 0.0)
}
