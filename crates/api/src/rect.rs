//! A box of a target.

use serde::Serialize;
use serde::de::{Deserialize, Deserializer, Error};
use std::fmt;
use std::str::FromStr;

/// A box in the pixels of the uploaded frame; the origin is the frame's top-left corner. It may reach over the edge.
///
/// It is read from an object, an array of four numbers, or the text of either or of `x,y,width,height`; all numbers are
/// finite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(feature = "service", derive(utoipa::ToSchema), schema(
    as = Box, description = "A box in the pixels of the uploaded frame; the origin is the frame's top-left corner. It \
        may reach over the edge.",
    example = json!({"x": 10.0, "y": 20.0, "width": 30.0, "height": 40.0})
))]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width, above 0.
    #[cfg_attr(feature = "service", schema(exclusive_minimum = 0.0))]
    pub width: f64,
    /// Height, above 0.
    #[cfg_attr(feature = "service", schema(exclusive_minimum = 0.0))]
    pub height: f64,
}

impl Rect {
    /// Rounded to a hundredth of a pixel, as in answers; further digits mean nothing.
    pub fn rounded(self) -> Self {
        // A negative zero becomes a positive one.
        let round = |value: f64| (value * 100.0).round() / 100.0 + 0.0;
        Self {
            x: round(self.x),
            y: round(self.y),
            width: round(self.width),
            height: round(self.height),
        }
    }
}

impl From<[f64; 4]> for Rect {
    /// From `[x, y, width, height]`.
    fn from([x, y, width, height]: [f64; 4]) -> Self {
        Self {
            x,
            y,
            width,
            height,
        }
    }
}

/// `x,y,width,height`, as in queries, with all digits of the numbers.
impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.width, self.height)
    }
}

/// The text is no box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "`box` must be four numbers `x,y,width,height` or the object \
     {{\"x\": 1, \"y\": 2, \"width\": 30, \"height\": 40}}"
)]
pub struct NotABox;

impl FromStr for Rect {
    type Err = NotABox;

    /// Reads `x,y,width,height`, a JSON object with these names, or a JSON array in this order.
    fn from_str(text: &str) -> Result<Self, NotABox> {
        if text.starts_with('{') {
            return serde_json::from_str(text).map_err(|_| NotABox);
        }
        let list = text
            .strip_prefix('[')
            .and_then(|text| text.strip_suffix(']'))
            .unwrap_or(text);
        let numbers = list.split(',').map(|number| number.trim().parse::<f64>());
        let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|_| NotABox)?;
        match <[f64; 4]>::try_from(numbers) {
            Ok(numbers) if numbers.iter().all(|n| n.is_finite()) => Ok(numbers.into()),
            _ => Err(NotABox),
        }
    }
}

/// How a box may be written.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Notation {
    Object {
        x: f64,
        y: f64,
        width: f64,
        height: f64,
    },
    Array([f64; 4]),
    Text(String),
}

impl<'de> Deserialize<'de> for Rect {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Notation::deserialize(deserializer) {
            Ok(Notation::Object {
                x,
                y,
                width,
                height,
            }) => Ok([x, y, width, height].into()),
            Ok(Notation::Array(numbers)) => Ok(numbers.into()),
            Ok(Notation::Text(text)) => text.parse().map_err(D::Error::custom),
            Err(_) => Err(D::Error::custom(NotABox)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_read_in_each_notation() {
        let expected = Rect::from([-1.5, 2.0, 30.0, 4e1]);
        for text in [
            "-1.5,2,30,40",
            "-1.5, 2 ,30 , 40",
            "[-1.5, 2, 30, 40]",
            r#"{"x": -1.5, "y": 2, "width": 30, "height": 40}"#,
        ] {
            assert_eq!(text.parse(), Ok(expected), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused() {
        for text in [
            "",
            "1,2,3",
            "1,2,3,4,5",
            "1,2,nan,4",
            "1,2,inf,4",
            "a,b,c,d",
            "{}",
            "[1,2,3,4",
        ] {
            assert_eq!(text.parse::<Rect>(), Err(NotABox), "{text}");
        }
    }

    #[test]
    fn json_has_a_box_in_each_notation_and_nothing_else_is_one() {
        let expected = Rect::from([1.0, 2.0, 30.0, 40.0]);
        for text in [
            r#"{"x": 1, "y": 2, "width": 30, "height": 40}"#,
            "[1, 2, 30, 40]",
            r#""1,2,30,40""#,
            r#""{\"x\": 1, \"y\": 2, \"width\": 30, \"height\": 40}""#,
        ] {
            assert_eq!(
                serde_json::from_str::<Rect>(text).ok(),
                Some(expected),
                "{text}"
            );
        }
        for text in ["1", "[1, 2, 30]", "{}", "true", r#""""#] {
            let error = serde_json::from_str::<Rect>(text).unwrap_err();
            assert!(
                error.to_string().starts_with(&NotABox.to_string()),
                "{text}: {error}"
            );
        }
    }
}
