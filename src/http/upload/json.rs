//! JSON uploads: frames as base64, settings as values.

use super::{Form, Upload};
use crate::http::problem::Problem;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use bytes::Bytes;
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Standard base64, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Reads a JSON body.
pub fn read(form: &Form, body: &[u8], upload: &mut Upload) -> Result<(), Problem> {
    let object: BTreeMap<Cow<str>, &RawValue> = serde_json::from_slice(body)
        .map_err(|error| Problem::malformed(format!("The body is not a JSON object: {error}.")))?;
    let several = form.several.then_some("frames");
    for (name, value) in object {
        match &*name {
            _ if value.get() == "null" => {}
            "frame" => upload.frames.push(frame(text(&name, value)?)?),
            "frames" if form.several => {
                let frames: Vec<Cow<str>> = serde_json::from_str(value.get()).map_err(|_| {
                    Problem::malformed("`frames` must be an array of base64 strings.")
                })?;
                for text in frames {
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
                let frames = std::iter::once("frame").chain(several);
                return Err(form.unknown("field", unknown, frames));
            }
        }
    }
    Ok(())
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
