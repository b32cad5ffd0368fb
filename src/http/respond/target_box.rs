//! Boxes as they are sent and received.

use bagtrack_tracker::Rect;
use serde::Serialize;
use serde::de::{Deserialize, Deserializer, Error};
use std::borrow::Cow;
use std::str::FromStr;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ObjectBuilder, Schema, SchemaFormat, Type};
use utoipa::{PartialSchema, ToSchema};

/// A box in the pixels of the uploaded frame; the origin is the frame's top-left corner. It may reach over the edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, utoipa::ToSchema)]
#[schema(as = Box, example = json!({"x": 10.0, "y": 20.0, "width": 30.0, "height": 40.0}))]
pub struct TargetBox {
    /// Left edge.
    x: f64,
    /// Top edge.
    y: f64,
    /// Width, above 0.
    #[schema(exclusive_minimum = 0.0)]
    width: f64,
    /// Height, above 0.
    #[schema(exclusive_minimum = 0.0)]
    height: f64,
}

/// A number in `x,y,width,height`; the last two are above 0.
pub(super) const NUMBER: &str = r"(?:[0-9]{1,5}(?:\.[0-9]{1,4})?)";

/// What a text has to be to be taken as a box. A JSON object or array in a text is taken, too.
fn text_schema() -> ObjectBuilder {
    let pattern = format!("^-?{NUMBER},-?{NUMBER},{NUMBER},{NUMBER}$");
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::Custom("box".to_owned())))
        .pattern(Some(pattern))
        .examples(["10,20,30,40"])
}

/// A box as a text, in the query and in forms.
#[derive(Debug)]
pub struct BoxText;

impl ToSchema for BoxText {}

impl PartialSchema for BoxText {
    fn schema() -> RefOr<Schema> {
        text_schema().build().into()
    }
}

impl TargetBox {
    /// As it is answered: to a hundredth of a pixel. No digit after that means anything.
    pub fn answered(rect: Rect) -> Self {
        // A negative zero becomes a positive one.
        let round = |value: f64| (value * 100.0).round() / 100.0 + 0.0;
        Self {
            x: round(rect.x),
            y: round(rect.y),
            width: round(rect.width),
            height: round(rect.height),
        }
    }
}

impl From<Rect> for TargetBox {
    fn from(rect: Rect) -> Self {
        Self {
            x: rect.x,
            y: rect.y,
            width: rect.width,
            height: rect.height,
        }
    }
}

impl From<TargetBox> for Rect {
    fn from(target: TargetBox) -> Self {
        Self::new(target.x, target.y, target.width, target.height)
    }
}

/// The text is no box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "`box` must be four numbers `x,y,width,height` or the object \
     {{\"x\": 1, \"y\": 2, \"width\": 30, \"height\": 40}}"
)]
pub struct NotABox;

impl FromStr for TargetBox {
    type Err = NotABox;

    /// Reads `x,y,width,height`, a JSON object with these names, or a JSON array in this order.
    fn from_str(text: &str) -> Result<Self, NotABox> {
        if text.starts_with('{') {
            let rect: Rect = serde_json::from_str(text).map_err(|_| NotABox)?;
            return Ok(rect.into());
        }
        let list = text
            .strip_prefix('[')
            .and_then(|text| text.strip_suffix(']'))
            .unwrap_or(text);
        let numbers = list.split(',').map(|number| number.trim().parse::<f64>());
        let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|_| NotABox)?;
        match numbers[..] {
            [x, y, width, height] if numbers.iter().all(|n| n.is_finite()) => {
                Ok(Rect::new(x, y, width, height).into())
            }
            _ => Err(NotABox),
        }
    }
}

impl<'de> Deserialize<'de> for TargetBox {
    /// Reads the text of a box.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Cow::<str>::deserialize(deserializer)?
            .parse()
            .map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_read_in_each_notation() {
        let expected = Rect::new(-1.5, 2.0, 30.0, 4e1);
        for text in [
            "-1.5,2,30,40",
            "-1.5, 2 ,30 , 40",
            "[-1.5, 2, 30, 40]",
            r#"{"x": -1.5, "y": 2, "width": 30, "height": 40}"#,
        ] {
            assert_eq!(text.parse::<TargetBox>(), Ok(expected.into()), "{text}");
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
            assert_eq!(text.parse::<TargetBox>(), Err(NotABox), "{text}");
        }
    }
}
