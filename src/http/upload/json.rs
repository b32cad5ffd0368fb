//! JSON uploads: frames as base64, settings as values.

use super::{Form, Upload};
use crate::http::problem::Problem;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use bytes::Bytes;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::fmt;

/// Standard base64, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Most fields of an object; there are not nearly as many names.
const MAX_FIELDS: usize = 32;

/// The fields of a JSON object, in order. What is in them is not parsed, and an object with more fields than names
/// is refused early: parsed JSON can take many times the room of its text.
struct Object<'a>(Vec<(Cow<'a, str>, &'a RawValue)>);

impl<'de: 'a, 'a> Deserialize<'de> for Object<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ObjectVisitor)
    }
}

struct ObjectVisitor;

impl<'de> Visitor<'de> for ObjectVisitor {
    type Value = Object<'de>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Object<'de>, A::Error> {
        let mut fields = Vec::new();
        while let Some(field) = map.next_entry()? {
            fields.push(field);
            if fields.len() > MAX_FIELDS {
                return Err(serde::de::Error::custom("too many fields"));
            }
        }
        Ok(Object(fields))
    }
}

/// Reads a JSON body with at most `most` frames.
pub fn read(form: &Form, most: usize, body: &[u8], upload: &mut Upload) -> Result<(), Problem> {
    let Object(fields) = serde_json::from_slice(body)
        .map_err(|error| Problem::malformed(format!("The body is not a JSON object: {error}.")))?;
    for (name, value) in fields {
        match &*name {
            _ if value.get() == "null" => {}
            "frame" => upload.frames.push(frame(text(&name, value)?)?),
            "frames" if form.several => {
                for text in frames(value, most)? {
                    upload.frames.push(frame(text)?);
                }
            }
            setting if form.settings.contains(&setting) => {
                let value = match value.get().starts_with('"') {
                    true => text(&name, value)?,
                    false => Cow::Borrowed(value.get()),
                };
                upload.fields.set(setting, &value)?;
            }
            unknown => {
                let several = form.several.then_some("frames");
                let frames = std::iter::once("frame").chain(several);
                return Err(form.unknown("field", unknown, frames));
            }
        }
    }
    Ok(())
}

fn frames(value: &RawValue, most: usize) -> Result<Vec<Cow<'_, str>>, Problem> {
    // Two quotes a string: base64 has none of its own.
    let quotes = value.get().bytes().filter(|byte| *byte == b'"').count();
    if quotes > 2 * most {
        return Err(Problem::too_many_frames(most));
    }
    serde_json::from_str(value.get())
        .map_err(|_| Problem::malformed("`frames` must be an array of base64 strings."))
}

fn text<'a>(name: &str, value: &'a RawValue) -> Result<Cow<'a, str>, Problem> {
    // `Cow` would copy here; most strings have no escapes and can be borrowed.
    match serde_json::from_str::<&str>(value.get()) {
        Ok(text) => Ok(Cow::Borrowed(text)),
        Err(_) => serde_json::from_str::<String>(value.get())
            .map(Cow::Owned)
            .map_err(|_| Problem::malformed(format!("`{name}` must be a string."))),
    }
}

/// Base64, possibly as a data URL, possibly broken into lines.
fn frame(text: Cow<str>) -> Result<Bytes, Problem> {
    let encoded = match text.strip_prefix("data:") {
        Some(url) => {
            let split = url.split_once(";base64,").map(|(_, encoded)| encoded);
            split
                .ok_or_else(|| Problem::malformed("A data URL must be `data:image/…;base64,…`."))?
        }
        None => &text,
    };
    let has_space = encoded.bytes().any(|byte| byte.is_ascii_whitespace());
    let decoded = if has_space {
        BASE64.decode(encoded.split_ascii_whitespace().collect::<String>())
    } else {
        BASE64.decode(encoded)
    };
    decoded
        .map(Bytes::from)
        .map_err(|error| Problem::malformed(format!("A frame is not base64: {error}.")))
}
