//! The text messages of a stream, as JSON.

use crate::http::problems::problem::Problem;
use crate::http::respond::target_box::TargetBox;
use bagtrack_sessions::GivenBox;
use serde::{Deserialize, Deserializer, Serialize, de};
use serde_json::Value;

/// Most bytes of a text message.
const MAX_TEXT_BYTES: usize = 4096;

/// What a client says of the frame that comes next.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameHeader {
    /// Its number.
    #[serde(default)]
    pub frame: Option<u64>,
    /// The box in it, where the user corrects it.
    #[serde(default, deserialize_with = "target_box")]
    pub r#box: Option<TargetBox>,
    /// Which target is corrected, or is told about, counted from 0.
    #[serde(default)]
    pub target: Option<usize>,
    /// Whether the answer shall tell what the tracker saw.
    #[serde(default)]
    pub see: bool,
}

/// A box as an object, an array, or the text that queries have.
fn target_box<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<TargetBox>, D::Error> {
    let text = match Value::deserialize(deserializer)? {
        Value::Null => return Ok(None),
        Value::String(text) => text,
        value => value.to_string(),
    };
    text.parse().map(Some).map_err(de::Error::custom)
}

impl FrameHeader {
    /// The correction, where there is one.
    pub fn correction(&self) -> Option<GivenBox> {
        let target = self.target;
        self.r#box.map(|to| GivenBox {
            target,
            to: to.into(),
        })
    }

    /// Reads a text message.
    ///
    /// # Errors
    /// It is no such JSON.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        if text.len() > MAX_TEXT_BYTES {
            let detail = format!("A text message may have at most {MAX_TEXT_BYTES} bytes.");
            return Err(Problem::malformed(detail));
        }
        serde_json::from_str(text).map_err(|error| {
            let detail = format!(
                "The text message before the frame cannot be read: {error}. Send {{\"frame\": N}}, {{\"box\": …}} or \
                 both."
            );
            Problem::malformed(detail)
        })
    }
}

/// The first message of the service.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Hello {
    /// The number of the next frame.
    pub next: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_has_a_number_or_a_box_in_any_notation() {
        let box_of = |text: &str| FrameHeader::parse(text).unwrap().r#box;
        let expected = "1,2,30,40".parse().ok();
        for text in [
            r#"{"box": {"x": 1, "y": 2, "width": 30, "height": 40}}"#,
            r#"{"box": [1, 2, 30, 40], "frame": 3}"#,
            r#"{"box": "1,2,30,40"}"#,
        ] {
            assert_eq!(box_of(text), expected, "{text}");
        }
        assert_eq!(
            FrameHeader::parse(r#"{"frame": 7}"#).unwrap().frame,
            Some(7)
        );
        for text in [
            "",
            "7",
            r#"{"box": 1}"#,
            r#"{"colour": 1}"#,
            r#"{"frame": -1}"#,
        ] {
            assert!(FrameHeader::parse(text).is_err(), "{text}");
        }
    }
}
