//! What a new track begins with: boxes, and a preset with single parameters set otherwise.

use crate::http::problems::problem::Problem;
use bagtrack_api::requests::{MAX_EXACT, Seed, resolve_params};
use bagtrack_api::{self as api, Parameters, PresetName};
use bagtrack_sessions::random::random_range;
use bagtrack_sessions::{Boxes, PerTarget};
use bagtrack_tracker::{Params, Rect};

/// The interface takes as many boxes as a session may have targets.
const _: () = assert!(api::MAX_TARGETS == bagtrack_sessions::MAX_TARGETS);

pub fn rect(target: api::Rect) -> Rect {
    Rect::new(target.x, target.y, target.width, target.height)
}

/// The boxes of a new session's targets.
///
/// # Errors
/// There is neither a box nor a list of boxes, or both.
pub fn boxes(target: Option<api::Rect>, targets: Option<api::Boxes>) -> Result<Boxes, Problem> {
    match (target, targets) {
        (Some(target), None) => Ok(PerTarget::One(rect(target))),
        (None, Some(list)) => {
            let list = list.as_slice().iter().map(|target| rect(*target));
            Ok(PerTarget::List(list.collect()))
        }
        (None, None) => Err(Problem::missing_box()),
        (Some(_), Some(_)) => {
            let detail = "Give `box` for one target or `boxes` for several, not both.";
            Err(Problem::malformed(detail))
        }
    }
}

/// See [`resolve_params`]. Without any seed a random one is drawn.
///
/// # Errors
/// A parameter is unknown or has the wrong type.
pub fn params(
    preset: Option<PresetName>,
    seed: Option<Seed>,
    overrides: Option<Parameters>,
) -> Result<Params, Problem> {
    let resolved = resolve_params(preset, seed, overrides, random_range(0..=MAX_EXACT));
    resolved.map_err(|error| Problem::invalid_parameter(error.to_string()))
}
