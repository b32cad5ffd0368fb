//! JSON uploads: `frame` and `frames` are base64, possibly as a data URL or broken into lines; all other fields are
//! settings.

use super::misnamed;
use super::texts::Fields;
use crate::http::problems::problem::Problem;
use bagtrack_api::requests::{FrameCount, Settings};
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::{DecodeError, Engine};
use bytes::Bytes;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::fmt;
use std::time::Duration;

/// Bytes that parsing takes for each byte of a body, beside the body: three quarters for the files, the rest for copies
/// of texts that have escapes or line breaks in them.
pub(super) const DECODED_PER_BYTE: usize = 2;

/// Least processor time of parsing a byte, in nanoseconds: it tells before that a large body is slow to parse.
const NANOS_PER_BYTE: u64 = 2;

/// Least processor time of parsing this number of bytes.
pub(super) fn least_time(bytes: usize) -> Duration {
    Duration::from_nanos((bytes as u64).saturating_mul(NANOS_PER_BYTE))
}

/// Standard base64, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Most fields of an object; no route takes nearly as many.
const MAX_FIELDS: usize = 32;

/// The fields of a JSON object, in order. Their values are not parsed, and an object with very many fields is refused
/// early: parsed JSON can take many times the memory of its text.
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

/// The mark that some editors put before UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// The text of a body that is JSON, else `None`. JSON begins with `{`, after a byte order mark and blanks; no image and
/// no snapshot does. A body that is labelled as JSON counts, too, if it begins with printable characters.
pub(super) fn text_of(body: &[u8], is_labelled: bool) -> Option<&[u8]> {
    let body = body.strip_prefix(BYTE_ORDER_MARK).unwrap_or(body);
    let text = body.trim_ascii_start();
    let is_printed = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    let is_text = || text.iter().take(64).all(is_printed);
    (text.starts_with(b"{") || is_labelled && is_text()).then_some(text)
}

/// Adds the fields of a JSON body to `fields`: at most `max_files` files.
pub(super) fn read<S: Settings>(
    body: &[u8],
    max_files: usize,
    fields: &mut Fields,
) -> Result<(), Problem> {
    let Object(members) = serde_json::from_slice(body)
        .map_err(|error| Problem::malformed(format!("The body is not a JSON object: {error}.")))?;
    for (name, value) in members {
        match &*name {
            _ if value.get() == "null" => {}
            "frame" => fields.files.push(decode(&text(&name, value)?)?),
            "snapshot" if S::TAKES_SNAPSHOT && fields.snapshot.is_none() => {
                fields.snapshot = Some(decode(&text(&name, value)?)?);
            }
            "frames" if S::FRAMES == FrameCount::Several => {
                for text in frames::<S>(value, max_files)? {
                    fields.files.push(decode(&text)?);
                }
            }
            _ => {
                if let Some(problem) = misnamed::field::<S>(&name, value.get()) {
                    return Err(problem);
                }
                match value.get().starts_with('"') {
                    true => fields.texts.add(&name, &text(&name, value)?)?,
                    false => fields.texts.add(&name, value.get())?,
                }
            }
        }
    }
    Ok(())
}

fn frames<S: Settings>(value: &RawValue, max_files: usize) -> Result<Vec<Cow<'_, str>>, Problem> {
    // Each string has two quotes, and base64 has no quotes of its own.
    let quotes = value.get().bytes().filter(|byte| *byte == b'"').count();
    if quotes > 2 * max_files {
        return Err(Problem::too_many_frames::<S>(max_files));
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

/// The bytes of a file from its base64 or its data URL.
///
/// # Errors
/// The text is a URL, or not base64 in the standard alphabet.
fn decode(text: &str) -> Result<Bytes, Problem> {
    if let Some((scheme, _)) = text.trim_start().split_once("://")
        && scheme.chars().all(|c| c.is_ascii_alphanumeric())
    {
        let detail = "A file is given as a URL, and URLs are not fetched. Send its bytes as base64, or as the body.";
        return Err(Problem::malformed(detail));
    }
    let encoded = match text.strip_prefix("data:") {
        Some(url) => {
            let split = url.split_once(";base64,").map(|(_, encoded)| encoded);
            split
                .ok_or_else(|| Problem::malformed("A data URL must be `data:image/…;base64,…`."))?
        }
        None => text,
    };
    let has_space = encoded.bytes().any(|byte| byte.is_ascii_whitespace());
    let decoded = if has_space {
        BASE64.decode(encoded.split_ascii_whitespace().collect::<String>())
    } else {
        BASE64.decode(encoded)
    };
    decoded.map(Bytes::from).map_err(|error| {
        if let DecodeError::InvalidByte(_, b'-' | b'_') = error {
            let detail =
                "A file is base64 for URLs; send it in the standard alphabet, with `+` and `/`.";
            return Problem::malformed(detail);
        }
        let error = error.to_string();
        let reason = error.trim_end_matches('.');
        Problem::malformed(format!("A file is not base64: {reason}."))
    })
}
