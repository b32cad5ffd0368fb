//! The settings of each call.

use super::values::{
    BoxText, BoxesText, FileFormatText, FrameNumber, FrameRate, Name, Names, NamesText,
    ParametersText, Seed, Switch, TargetNumber,
};
use super::{FrameCount, Settings};
use crate::boxes::Boxes;
use crate::parameters::{Parameters, PresetName};
use crate::rect::Rect;
use bagtrack_formats::FileFormat;
use serde::Deserialize;

/// The settings of a new session.
#[derive(Debug, Default, PartialEq, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CreateSettings {
    /// The target's box: `x,y,width,height`, or a JSON object with these names. In the query or in the
    /// body; that of the body counts.
    #[param(value_type = BoxText, inline, required = false, example = "10,20,30,40")]
    pub r#box: Option<Rect>,
    /// In place of `box`, the boxes of several targets, at most 16: `x,y,width,height;x,y,width,height`, or a JSON
    /// array of boxes. Then answers have an array `targets`, in this order.
    #[param(value_type = BoxesText, inline, required = false)]
    pub boxes: Option<Boxes>,
    /// `robust` (the default) or `paper`.
    #[param(nullable = false)]
    pub preset: Option<PresetName>,
    /// Seed of all random draws, which counts before that of `parameters`; a random one when left out.
    #[param(value_type = Seed, inline, required = false)]
    pub seed: Option<Seed>,
    /// A JSON object of parameters that are set otherwise than in the preset. Each has a range, and some have a limit
    /// together; see the call.
    #[serde(rename = "parameters")]
    #[param(value_type = ParametersText, inline, required = false, example = "{\"seed\": 7}")]
    pub params: Option<Parameters>,
    /// Whether the answer names the tracker's parameters.
    #[param(value_type = bool, required = false, default = false)]
    #[serde(default)]
    pub verbose: Switch,
}

impl Settings for CreateSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Create";
}

/// The settings of a request with the next frames.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FramesSettings {
    /// The number of the (first) frame of this request.
    #[param(value_type = FrameNumber, inline, required = false)]
    pub frame: Option<FrameNumber>,
    /// Whether the answer is the frame as PNG, with boxes, scores and particles drawn on it. Then the header `Answer`
    /// has the answer as JSON.
    #[serde(default)]
    #[param(value_type = bool, required = false, default = false)]
    pub draw: Switch,
}

impl Settings for FramesSettings {
    const FRAMES: FrameCount = FrameCount::Several;
    const TAKES_VIDEO: bool = true;
    const SCHEMA_PREFIX: &'static str = "Frames";
}

/// The settings of a correction.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct TargetSettings {
    /// The corrected box: `x,y,width,height`, or a JSON object with these names. In the query or in the
    /// body; that of the body counts.
    #[param(value_type = BoxText, inline, required = false, example = "10,20,30,40")]
    pub r#box: Option<Rect>,
    /// The number of this frame; see `POST /sessions/{id}/frames`.
    #[param(value_type = FrameNumber, inline, required = false)]
    pub frame: Option<FrameNumber>,
    /// Which target is corrected, counted from 0, in a session that was opened with `boxes`. The others are tracked.
    #[param(value_type = TargetNumber, inline, required = false)]
    pub target: Option<TargetNumber>,
}

impl Settings for TargetSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const SCHEMA_PREFIX: &'static str = "Target";
}

/// The settings of a request without a session.
#[derive(Debug, Default, PartialEq, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct TrackSettings {
    /// Without a snapshot, the target's box in the first frame; with one, a correction, as in
    /// `PUT /sessions/{id}/target`: `x,y,width,height`, or a JSON object with these names.
    #[param(value_type = BoxText, inline, required = false, example = "10,20,30,40")]
    pub r#box: Option<Rect>,
    /// In place of `box`, the boxes of several targets; see `POST /sessions`. Only without a snapshot.
    #[param(value_type = BoxesText, inline, required = false)]
    pub boxes: Option<Boxes>,
    /// Which target `box` corrects, counted from 0, where there are several. Only with a snapshot.
    #[param(value_type = TargetNumber, inline, required = false)]
    pub target: Option<TargetNumber>,
    /// `robust` (the default) or `paper`. Only without a snapshot.
    #[param(nullable = false)]
    pub preset: Option<PresetName>,
    /// Seed of all random draws, which counts before that of `parameters`; a random one when left out. Only without a
    /// snapshot.
    #[param(value_type = Seed, inline, required = false)]
    pub seed: Option<Seed>,
    /// A JSON object of parameters that are set otherwise than in the preset. Only without a snapshot.
    #[serde(rename = "parameters")]
    #[param(value_type = ParametersText, inline, required = false, example = "{\"seed\": 7}")]
    pub params: Option<Parameters>,
    /// Of a video, the frame in which the boxes hold, counted from 0. Those before it are passed over.
    #[param(value_type = FrameNumber, inline, required = false)]
    pub start: Option<FrameNumber>,
    /// Of a video, track at most so many frames after the first one.
    #[param(value_type = FrameNumber, inline, required = false)]
    pub count: Option<FrameNumber>,
    /// Of a video, track from `start` back to frame 0. The frames in between are kept as JPEG files in the memory for
    /// uploads; where they do not fit, `count` makes them fewer.
    #[param(value_type = bool, required = false, default = false)]
    #[serde(default)]
    pub backwards: Switch,
    /// Of a video, end when every target has been lost.
    #[param(value_type = bool, required = false, default = false)]
    #[serde(default)]
    pub until_lost: Switch,
    /// Of a video, answer only key frames: between two of them straight lines give every edge of every box to within a
    /// pixel. Of several targets, the key frames of each.
    #[param(value_type = bool, required = false, default = false)]
    #[serde(default)]
    pub keyframes: Switch,
    /// Of a video, answer one file of this format when all is tracked, as `bagtrack track --format` writes it: a table
    /// for people, JSON lines, CSV, the result files of the Object Tracking Benchmark and of the MOTChallenge, COCO,
    /// CVAT for video 1.1 or Label Studio.
    #[param(value_type = FileFormatText, inline, required = false)]
    pub format: Option<FileFormat>,
    /// With `format`, what the targets are called, in their order: `van,rider`, or a JSON array of texts. The others
    /// are called `Object 1`, `Object 2`, …
    #[param(value_type = NamesText, inline, required = false)]
    pub names: Option<Names>,
    /// With `format`, what the video is called in the file: its name, or for `label-studio` its address.
    #[param(value_type = String, required = false, nullable = false, max_length = 200)]
    pub video_name: Option<Name>,
    /// With `format`, frames a second, which give the times in the file. Without it they are the video's own.
    #[param(
        value_type = f64,
        required = false,
        nullable = false,
        minimum = 0.001,
        maximum = 1000
    )]
    pub rate: Option<FrameRate>,
}

impl Settings for TrackSettings {
    const FRAMES: FrameCount = FrameCount::Several;
    const TAKES_SNAPSHOT: bool = true;
    const TAKES_VIDEO: bool = true;
    const SCHEMA_PREFIX: &'static str = "Track";
}

/// A video to decode has no settings.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct DecodeSettings {}

impl Settings for DecodeSettings {
    const FRAMES: FrameCount = FrameCount::One;
    const TAKES_VIDEO: bool = true;
    const SCHEMA_PREFIX: &'static str = "Decode";
}

/// The settings of a token.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct TokenSettings {
    /// Seconds that the token is good for.
    #[param(
        required = false,
        nullable = false,
        minimum = 1,
        maximum = 86_400,
        default = 3600
    )]
    pub seconds: Option<u32>,
}

/// The settings of the picture.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct BagSettings {
    /// Whose bag, counted from 0, in a session that was opened with `boxes`.
    #[param(value_type = u32, required = false, nullable = false, maximum = 15, default = 0)]
    pub target: Option<usize>,
}

/// The settings of a stream.
#[derive(Debug, Default, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct StreamSettings {
    /// The first frame whose answer the client has not got: the stored answers from it on are sent again.
    #[param(required = false, nullable = false)]
    pub from: Option<u64>,
    /// Whether a frame that waits is skipped when a newer one comes.
    #[param(value_type = bool, required = false, default = false)]
    #[serde(default)]
    pub drop: Switch,
}
