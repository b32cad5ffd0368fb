//! What the settings of a route are to the parsers and to the OpenAPI document.

use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error};
use std::borrow::Cow;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ObjectBuilder, Schema, SchemaType, Type};
use utoipa::{IntoParams, Number, PartialSchema, ToSchema};

/// How many frames a route takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameCount {
    /// Exactly one.
    One,
    /// One or more, up to the configured maximum.
    Several,
}

/// The settings of one route. They are parsed from their texts, by `Deserialize`; `IntoParams` and `ToSchema` describe
/// them in the query and in a body.
pub trait Settings: DeserializeOwned + IntoParams + ToSchema + Send + 'static {
    /// How many frames the route takes.
    const FRAMES: FrameCount;
    /// Whether a snapshot may come beside the frames.
    const TAKES_SNAPSHOT: bool = false;
    /// Whether a video may come in place of the frames.
    const TAKES_VIDEO: bool = false;
    /// What the names of the schemas of its bodies begin with.
    const SCHEMA_PREFIX: &'static str;
}

/// A whole number from 0 to 2⁶⁴ - 1, parsed from its text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WholeNumber(pub u64);

impl WholeNumber {
    /// As an index; one that is too large for that stays too large for any list.
    pub fn as_index(self) -> usize {
        usize::try_from(self.0).unwrap_or(usize::MAX)
    }
}

impl<'de> Deserialize<'de> for WholeNumber {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let float = || text.parse().ok().and_then(whole);
        text.parse().ok().or_else(float).map(Self).ok_or_else(|| {
            let start: String = text.chars().take(64).collect();
            let max = u64::MAX;
            D::Error::custom(format!("`{start}` is not a whole number from 0 to {max}"))
        })
    }
}

/// A float without a fraction as a whole number: JSON does not tell 46.0 from 46. None from 2^53 on, where a float does
/// not tell neighbours apart.
pub fn whole(value: f64) -> Option<u64> {
    let is_whole = value.fract() == 0.0 && (0.0..9_007_199_254_740_992.0).contains(&value);
    is_whole.then_some(value as u64)
}

fn number_schema(schema_type: impl Into<SchemaType>) -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(schema_type)
        .minimum(Some(Number::UInt(0)))
        .maximum(Some(Number::UInt(usize::MAX)))
}

/// A whole number in the query and in forms.
#[derive(Debug)]
pub struct NumberText;

impl ToSchema for NumberText {}

impl PartialSchema for NumberText {
    fn schema() -> RefOr<Schema> {
        number_schema(Type::Integer).build().into()
    }
}

/// A whole number in a JSON body, which may be a text.
#[derive(Debug)]
pub struct NumberInput;

impl ToSchema for NumberInput {}

impl PartialSchema for NumberInput {
    fn schema() -> RefOr<Schema> {
        let types = [Type::Integer, Type::String, Type::Null];
        let number = number_schema(SchemaType::from_iter(types));
        number.pattern(Some("^[0-9]{1,19}$")).build().into()
    }
}
