//! The text messages of a stream, as JSON.

use crate::http::problems::problem::Problem;
use crate::http::respond::answer::Answer;
use crate::http::respond::target_box::TargetBox;
use bagtrack_sessions::{Estimates, GivenBox};
use bagtrack_tracker::Diagnostics;
use serde::{Deserialize, Deserializer, Serialize, de};
use serde_json::Value;

/// Most particles in an answer.
const MAX_PARTICLES: usize = 200;
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

/// The answer to a frame.
#[derive(Debug, Clone, Serialize)]
pub struct StreamAnswer {
    #[serde(flatten)]
    answer: Answer,
    /// Frames before it that were skipped, with `drop=true`.
    #[serde(skip_serializing_if = "is_zero")]
    skipped: u64,
    /// Whether it was given before.
    #[serde(skip_serializing_if = "is_false")]
    replayed: bool,
    /// With a store: the last frame whose state is in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    checkpoint: Option<u64>,
    /// Whether the service is about to end.
    #[serde(skip_serializing_if = "is_false")]
    draining: bool,
    #[serde(flatten)]
    seen: Option<SeenView>,
}

/// What the tracker saw in the frame.
#[derive(Debug, Clone, Serialize)]
pub struct SeenView {
    /// For the likeliest particles, likeliest first: centre (x, y), width, and weight.
    particles: Vec<[f64; 4]>,
    /// For each entry of the bag, oldest first, its share of the vote for the best particle.
    votes: Vec<f64>,
}

impl From<Diagnostics> for SeenView {
    fn from(mut seen: Diagnostics) -> Self {
        seen.particles.sort_by(|a, b| b.1.total_cmp(&a.1));
        let shown = seen.particles.iter().take(MAX_PARTICLES);
        let round = |value: f64, digits: f64| (value * digits).round() / digits;
        let particles = shown.map(|(area, weight)| {
            let (x, y) = area.center();
            [
                round(x, 10.0),
                round(y, 10.0),
                round(area.width, 10.0),
                round(*weight, 1e5),
            ]
        });
        Self {
            particles: particles.collect(),
            votes: seen.votes.iter().map(|vote| round(*vote, 1e4)).collect(),
        }
    }
}

impl StreamAnswer {
    /// The answer to a frame before which so many were skipped.
    pub fn new(estimates: &Estimates, skipped: u64, replayed: bool, draining: bool) -> Self {
        Self {
            answer: estimates.into(),
            skipped,
            replayed,
            checkpoint: None,
            draining,
            seen: None,
        }
    }

    /// With the last frame whose state is in the store.
    pub fn with_checkpoint(mut self, checkpoint: Option<u64>) -> Self {
        self.checkpoint = checkpoint;
        self
    }

    /// With what may be wrong with the box that was given, where anything is.
    pub fn with_warnings(mut self, warnings: Option<Vec<String>>) -> Self {
        self.answer = self.answer.with_warnings(warnings);
        self
    }

    /// With what the tracker saw.
    pub fn with_seen(mut self, seen: Option<Diagnostics>) -> Self {
        self.seen = seen.map(SeenView::from);
        self
    }
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

fn is_false(flag: &bool) -> bool {
    !flag
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
