//! The settings of each call, as the service reads them, and the schemas of the bodies that carry them.
//!
//! In: the texts of settings, from the query, a form or a JSON object. Out: a struct for each call. Its schema, and
//! those of the bodies with the same settings, go into the OpenAPI document; so the document says what is read.
//!
//! What can go wrong: a setting is unknown, or its value has the wrong type. The parser refuses it and names the
//! setting.

mod bodies;
mod params;
mod settings;
mod values;

pub use bodies::{BinaryBody, FormBody, JsonBody};
pub use params::{ParamsError, public_params, resolve_params};
pub use settings::{
    BagSettings, CreateSettings, DecodeSettings, FramesSettings, StreamSettings, TargetSettings,
    TokenSettings, TrackSettings,
};
pub use values::{
    FrameNumber, FrameRate, MAX_EXACT, Name, Names, Seed, Switch, TargetNumber, number_schema,
    whole,
};

use serde::de::DeserializeOwned;
use utoipa::IntoParams;

/// How many frames a route takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameCount {
    /// Exactly one.
    One,
    /// One or more, up to the configured maximum.
    Several,
}

/// The settings of one route. `Deserialize` parses them from their texts; `IntoParams` describes them in the document.
pub trait Settings: DeserializeOwned + IntoParams + Send + 'static {
    /// How many frames the route takes.
    const FRAMES: FrameCount;
    /// Whether a snapshot may come beside the frames.
    const TAKES_SNAPSHOT: bool = false;
    /// Whether a video may come in place of the frames.
    const TAKES_VIDEO: bool = false;
    /// The prefix of the names of its bodies' schemas.
    const SCHEMA_PREFIX: &'static str;
}
