//! Files in JSON: base64, possibly as a data URL, possibly broken into lines.

use crate::http::problems::problem::Problem;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::{DecodeError, Engine};
use bytes::Bytes;

/// Standard base64, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The file of a text.
///
/// # Errors
/// It is not base64.
pub fn decode(text: &str) -> Result<Bytes, Problem> {
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
