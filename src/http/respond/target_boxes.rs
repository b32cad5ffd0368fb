//! Lists of boxes as they are received, one for each target.

use super::target_box::{NUMBER, TargetBox};
use crate::http::problems::problem::Problem;
use bagtrack_sessions::{Boxes, MAX_TARGETS, PerTarget};
use bagtrack_tracker::Rect;
use serde::de::{Deserialize, Deserializer, Error};
use serde_json::Value;
use std::borrow::Cow;
use std::str::FromStr;
use utoipa::openapi::schema::{ObjectBuilder, Schema, Type};
use utoipa::openapi::{RefOr, SchemaFormat};
use utoipa::{PartialSchema, ToSchema};

/// The boxes of the targets, 1 to [`MAX_TARGETS`].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(transparent)]
pub struct TargetBoxes(Vec<TargetBox>);

/// The text is no list of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "`boxes` must be 1 to {MAX_TARGETS} boxes: `x,y,width,height;x,y,width,height` or the JSON array \
     [[1, 2, 30, 40], {{\"x\": 1, \"y\": 2, \"width\": 30, \"height\": 40}}]"
)]
pub struct NoBoxes;

impl FromStr for TargetBoxes {
    type Err = NoBoxes;

    /// Reads `x,y,width,height;x,y,width,height`, or a JSON array of boxes in any notation.
    fn from_str(text: &str) -> Result<Self, NoBoxes> {
        let texts: Vec<Cow<str>> = match text.starts_with('[') {
            false => text.split(';').map(Cow::Borrowed).collect(),
            true => {
                let values: Vec<Value> = serde_json::from_str(text).map_err(|_| NoBoxes)?;
                let text = |value| match value {
                    Value::String(text) => text,
                    value => value.to_string(),
                };
                values.into_iter().map(text).map(Cow::Owned).collect()
            }
        };
        let boxes = texts.iter().map(|text| text.trim().parse());
        let boxes: Vec<TargetBox> = boxes.collect::<Result<_, _>>().map_err(|_| NoBoxes)?;
        match (1..=MAX_TARGETS).contains(&boxes.len()) {
            true => Ok(Self(boxes)),
            false => Err(NoBoxes),
        }
    }
}

impl<'de> Deserialize<'de> for TargetBoxes {
    /// Reads the text of a list of boxes.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Cow::<str>::deserialize(deserializer)?
            .parse()
            .map_err(D::Error::custom)
    }
}

/// The boxes of a new session's targets.
///
/// # Errors
/// There is neither a box nor a list of boxes, or both.
pub fn boxes_of(
    target: Option<TargetBox>,
    targets: Option<&TargetBoxes>,
) -> Result<Boxes, Problem> {
    match (target, targets) {
        (Some(target), None) => Ok(PerTarget::One(target.into())),
        (None, Some(TargetBoxes(list))) => {
            let list = list.iter().map(|target| Rect::from(*target));
            Ok(PerTarget::List(list.collect()))
        }
        (None, None) => Err(Problem::missing_box()),
        (Some(_), Some(_)) => {
            let detail = "Give `box` for one target or `boxes` for several, not both.";
            Err(Problem::malformed(detail))
        }
    }
}

impl ToSchema for TargetBoxes {}

impl PartialSchema for TargetBoxes {
    /// What a text has to be to be taken as a list of boxes. A JSON array in a text is taken, too.
    fn schema() -> RefOr<Schema> {
        let one = format!("-?{NUMBER},-?{NUMBER},{NUMBER},{NUMBER}");
        let more = MAX_TARGETS - 1;
        let text = ObjectBuilder::new()
            .schema_type(Type::String)
            .format(Some(SchemaFormat::Custom("boxes".to_owned())))
            .pattern(Some(format!("^{one}(?:;{one}){{0,{more}}}$")));
        text.build().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<TargetBoxes, NoBoxes> {
        text.parse()
    }

    #[test]
    fn a_list_is_read_in_each_notation() {
        let one = |text: &str| text.parse::<TargetBox>().unwrap();
        let expected = TargetBoxes(vec![one("-1.5,2,30,40"), one("5,6,7,8")]);
        for text in [
            "-1.5,2,30,40;5,6,7,8",
            " -1.5,2,30,40 ; [5, 6, 7, 8]",
            "[[-1.5, 2, 30, 40], [5, 6, 7, 8]]",
            r#"[{"x": -1.5, "y": 2, "width": 30, "height": 40}, "5,6,7,8"]"#,
        ] {
            assert_eq!(read(text), Ok(expected.clone()), "{text}");
        }
        assert_eq!(read("1,2,3,4;").unwrap_err(), NoBoxes);
    }

    #[test]
    fn an_empty_or_too_long_list_and_other_texts_are_refused() {
        let many = |count: usize| vec!["1,2,3,4"; count].join(";");
        assert!(read(&many(MAX_TARGETS)).is_ok());
        for text in ["", "[]", "1,2,3", "[1,2,3,4]", "[[1,2,3,4]", &many(17)] {
            assert_eq!(read(text), Err(NoBoxes), "{text}");
        }
    }
}
