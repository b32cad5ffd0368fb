//! The text messages of a stream, and the lines of an answer in JSON lines.

use super::answer::Answer;
use super::rect::Rect;
use serde::{Deserialize, Serialize};

/// A client's text message about the frame that it sends next.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrameHeader {
    /// The number of that frame.
    pub frame: Option<u64>,
    /// The corrected box of the target in that frame, if the user gives one.
    #[serde(rename = "box")]
    pub rect: Option<Rect>,
    /// The target that `rect` corrects or `see` asks about, counted from 0.
    pub target: Option<usize>,
    /// Whether the answer shall have the target's [`Particles`].
    pub see: bool,
}

impl FrameHeader {
    /// Merges this text with a later one about the same frame. `None` if they are about different targets.
    pub fn and(self, later: Self) -> Option<Self> {
        let is_of_target = |header: &Self| header.rect.is_some() || header.see;
        let target = |header: &Self| header.target.unwrap_or(0);
        let is_of_two = target(&self) != target(&later);
        let merged = Self {
            frame: later.frame.or(self.frame),
            rect: later.rect.or(self.rect),
            target: later.target.or(self.target),
            see: later.see || self.see,
        };
        (!(is_of_two && is_of_target(&self) && is_of_target(&later))).then_some(merged)
    }
}

/// The first message of the service in a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// The number of the next frame.
    pub next: u64,
}

/// The answer to a frame in a stream or as a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StreamAnswer {
    /// The answer.
    #[serde(flatten)]
    pub answer: Answer,
    /// How many frames right before this one were skipped, with `drop=true`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub skipped: u64,
    /// Whether the frame was tracked before: this is its stored answer.
    #[serde(default, skip_serializing_if = "is_default")]
    pub replayed: bool,
    /// With a store: the number of the last frame whose state is in the store.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<u64>,
    /// Whether the service is about to end.
    #[serde(default, skip_serializing_if = "is_default")]
    pub draining: bool,
    /// The particles of the tracker, where the client asked for them.
    #[serde(flatten)]
    pub seen: Option<Particles>,
}

/// A tracker's likeliest particles in a frame, and the votes of its bag.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Particles {
    /// For the likeliest particles, likeliest first: centre (x, y), width, and weight.
    pub particles: Vec<[f64; 4]>,
    /// For each entry of the bag, oldest first, its share of the vote for the best particle.
    pub votes: Vec<f64>,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_has_a_number_or_a_box_in_any_notation() {
        let parse = |text: &str| serde_json::from_str::<FrameHeader>(text);
        let expected = "1,2,30,40".parse().ok();
        for text in [
            r#"{"box": {"x": 1, "y": 2, "width": 30, "height": 40}}"#,
            r#"{"box": [1, 2, 30, 40], "frame": 3}"#,
            r#"{"box": "1,2,30,40"}"#,
        ] {
            assert_eq!(parse(text).unwrap().rect, expected, "{text}");
        }
        assert_eq!(parse(r#"{"frame": 7}"#).unwrap().frame, Some(7));
        assert_eq!(parse(r#"{"box": null}"#).unwrap().rect, None);
        for text in [
            "",
            "7",
            r#"{"box": 1}"#,
            r#"{"colour": 1}"#,
            r#"{"frame": -1}"#,
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
