//! What the settings of a route are to the parsers and to the OpenAPI document.

use bagtrack_sessions::MAX_TARGETS;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error};
use std::borrow::Cow;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{KnownFormat, ObjectBuilder, Schema, SchemaFormat, SchemaType, Type};
use utoipa::{IntoParams, Number, PartialSchema, ToSchema};

/// How many frames a route takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameCount {
    /// Exactly one.
    One,
    /// One or more, up to the configured maximum.
    Several,
}

/// The settings of one route. They are parsed from their texts, by `Deserialize`; `IntoParams` describes them.
pub trait Settings: DeserializeOwned + IntoParams + Send + 'static {
    /// How many frames the route takes.
    const FRAMES: FrameCount;
    /// Whether a snapshot may come beside the frames.
    const TAKES_SNAPSHOT: bool = false;
    /// Whether a video may come in place of the frames.
    const TAKES_VIDEO: bool = false;
    /// What the names of the schemas of its bodies begin with.
    const SCHEMA_PREFIX: &'static str;
}

/// Off, unless it is given: as `name`, `name=true` or `name=1`. Python clients write `True` and `False`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Switch(pub bool);

impl<'de> Deserialize<'de> for Switch {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match &*Cow::<str>::deserialize(deserializer)? {
            "" | "true" | "True" | "1" => Ok(Self(true)),
            "false" | "False" | "0" => Ok(Self(false)),
            _ => Err(D::Error::custom("a switch is `true` or `false`")),
        }
    }
}

/// The greatest number that JSON holds exactly in every language: 2^53 - 1.
pub const MAX_EXACT: u64 = (1 << 53) - 1;
const MAX_TARGET: u64 = MAX_TARGETS as u64 - 1;

/// A whole number from 0 to `MAX`, parsed from its text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WholeNumber<const MAX: u64>(pub u64);

/// The seed of all random draws.
pub type Seed = WholeNumber<MAX_EXACT>;
/// The number of a frame.
pub type FrameNumber = WholeNumber<MAX_EXACT>;
/// Which target is meant, counted from 0.
pub type TargetNumber = WholeNumber<MAX_TARGET>;

impl TargetNumber {
    /// As an index.
    pub fn as_index(self) -> usize {
        usize::try_from(self.0).unwrap_or(usize::MAX)
    }
}

impl<'de, const MAX: u64> Deserialize<'de> for WholeNumber<MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let float = || text.parse().ok().and_then(whole);
        let number = text.parse().ok().or_else(float);
        number.filter(|n| *n <= MAX).map(Self).ok_or_else(|| {
            let start: String = text.chars().take(64).collect();
            D::Error::custom(format!("`{start}` is not a whole number from 0 to {MAX}"))
        })
    }
}

/// A float without a fraction as a whole number: JSON does not tell 46.0 from 46. None from 2^53 on, where a float does
/// not tell neighbours apart.
pub fn whole(value: f64) -> Option<u64> {
    let is_whole = value.fract() == 0.0 && (0.0..9_007_199_254_740_992.0).contains(&value);
    is_whole.then_some(value as u64)
}

/// The schema of a whole number from 0 to this one.
pub fn number_schema(schema_type: impl Into<SchemaType>, max: u64) -> ObjectBuilder {
    let format = match i32::try_from(max) {
        Ok(_) => KnownFormat::Int32,
        Err(_) => KnownFormat::Int64,
    };
    ObjectBuilder::new()
        .schema_type(schema_type)
        .format(Some(SchemaFormat::KnownFormat(format)))
        .minimum(Some(Number::UInt(0)))
        .maximum(Some(Number::UInt(
            usize::try_from(max).unwrap_or(usize::MAX),
        )))
}

impl<const MAX: u64> ToSchema for WholeNumber<MAX> {}

impl<const MAX: u64> PartialSchema for WholeNumber<MAX> {
    /// As a text in the query and in forms.
    fn schema() -> RefOr<Schema> {
        number_schema(Type::Integer, MAX).build().into()
    }
}
