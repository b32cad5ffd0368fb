//! The types of single settings, each parsed from its text, and their schemas.

use crate::boxes::MAX_TARGETS;
use crate::parameters::Parameters;
use bagtrack_formats::FileFormat;
use serde::de::{Deserialize, Deserializer, Error};
use std::borrow::Cow;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{KnownFormat, ObjectBuilder, Schema, SchemaFormat, SchemaType, Type};
use utoipa::{Number, PartialSchema, ToSchema};

/// A setting that is off unless given, as `name`, `name=true` or `name=1`. Python clients write `True` and `False`.
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

/// The name of a [`FileFormat`].
#[derive(Debug)]
pub struct FileFormatText;

impl ToSchema for FileFormatText {}

impl PartialSchema for FileFormatText {
    fn schema() -> RefOr<Schema> {
        let words = "The formats of tracked boxes beside the service's own answers: those of `bagtrack track --format` that \
            are one file.";
        let text = ObjectBuilder::new().schema_type(Type::String);
        let text = text.description(Some(words));
        text.enum_values(Some(FileFormat::names())).build().into()
    }
}

/// Most characters of a name in a file.
const MAX_NAME: usize = 200;

/// The name of a target or a video in a result file: 1 to 200 characters, none of them a control character.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Name(pub String);

impl TryFrom<String> for Name {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let is_name = (1..=MAX_NAME).contains(&text.chars().count());
        // XML 1.0 forbids most of these characters.
        let is_unseen = |sign: char| sign.is_control() || matches!(sign, '\u{fffe}' | '\u{ffff}');
        match is_name && !text.chars().any(is_unseen) {
            true => Ok(Self(text)),
            false => Err(format!(
                "a name has 1 to {MAX_NAME} characters, and no control characters"
            )),
        }
    }
}

impl<'de> Deserialize<'de> for Name {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

/// The names of the targets, at most [`MAX_TARGETS`]: `van,rider`, or a JSON array, which allows commas in names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names(pub Vec<Name>);

impl<'de> Deserialize<'de> for Names {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let names: Vec<Name> = match text.starts_with('[') {
            true => serde_json::from_str(&text).map_err(D::Error::custom)?,
            false => {
                let names = text
                    .split(',')
                    .map(|name| name.trim().to_owned().try_into());
                names.collect::<Result<_, _>>().map_err(D::Error::custom)?
            }
        };
        match names.len() <= MAX_TARGETS {
            true => Ok(Self(names)),
            false => Err(D::Error::custom(format!(
                "there are at most {MAX_TARGETS} targets to name"
            ))),
        }
    }
}

/// The names as a text, in the query and in forms.
#[derive(Debug)]
pub struct NamesText;

impl ToSchema for NamesText {}

impl PartialSchema for NamesText {
    fn schema() -> RefOr<Schema> {
        let words = "Separated by commas, or a JSON array of texts.";
        text_of("names").description(Some(words)).build().into()
    }
}

/// Frames a second, from 0.001 to 1000.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRate(pub f64);

impl<'de> Deserialize<'de> for FrameRate {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let rate = text.parse().ok().filter(|rate| (1e-3..=1e3).contains(rate));
        rate.map(Self).ok_or_else(|| {
            D::Error::custom("`rate` is a number of frames a second, from 0.001 to 1000")
        })
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

/// A float without a fraction as a whole number: to JSON, 46.0 and 46 are the same. `None` below 0, and from 2^53 on,
/// where a float cannot hold every whole number.
pub fn whole(value: f64) -> Option<u64> {
    let is_whole = value.fract() == 0.0 && (0.0..9_007_199_254_740_992.0).contains(&value);
    is_whole.then_some(value as u64)
}

/// The schema of a whole number from 0 to `max`.
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

/// The pattern of a number in `x,y,width,height`, without a sign.
const NUMBER: &str = r"(?:[0-9]{1,5}(?:\.[0-9]{1,4})?)";

/// The schema of a text of this format.
fn text_of(format: &str) -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::Custom(format.to_owned())))
}

/// A box as a text, in the query and in forms. A JSON object or array in a text is taken, too.
#[derive(Debug)]
pub struct BoxText;

impl ToSchema for BoxText {}

impl PartialSchema for BoxText {
    fn schema() -> RefOr<Schema> {
        let pattern = format!("^-?{NUMBER},-?{NUMBER},{NUMBER},{NUMBER}$");
        let text = text_of("box").pattern(Some(pattern));
        text.examples(["10,20,30,40"]).build().into()
    }
}

/// A list of boxes as a text. A JSON array in a text is taken, too.
#[derive(Debug)]
pub struct BoxesText;

impl ToSchema for BoxesText {}

impl PartialSchema for BoxesText {
    fn schema() -> RefOr<Schema> {
        let one = format!("-?{NUMBER},-?{NUMBER},{NUMBER},{NUMBER}");
        let more = MAX_TARGETS - 1;
        let text = text_of("boxes").pattern(Some(format!("^{one}(?:;{one}){{0,{more}}}$")));
        text.build().into()
    }
}

/// The parameters as a text, in the query and in forms.
#[derive(Debug)]
pub struct ParametersText;

impl ToSchema for ParametersText {}

impl PartialSchema for ParametersText {
    fn schema() -> RefOr<Schema> {
        let words = "A JSON object; its properties are those of the schema `Parameters`.";
        text_of("json").description(Some(words)).build().into()
    }
}

impl ToSchema for Parameters {}

impl PartialSchema for Parameters {
    /// A placeholder: `openapi::document` puts the schema of the tracker's parameters in its place.
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new().into()
    }
}
