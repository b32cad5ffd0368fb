//! Lists of boxes, one for each target.

use super::rect::Rect;
use serde::Serialize;
use serde::de::{Deserialize, Deserializer, Error};
use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

/// Most targets of a session.
pub const MAX_TARGETS: usize = 16;

/// The boxes of the targets, 1 to [`MAX_TARGETS`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Boxes(Vec<Rect>);

impl Boxes {
    /// The boxes, in the order of the targets.
    pub fn as_slice(&self) -> &[Rect] {
        &self.0
    }
}

impl TryFrom<Vec<Rect>> for Boxes {
    type Error = NoBoxes;

    fn try_from(boxes: Vec<Rect>) -> Result<Self, NoBoxes> {
        match (1..=MAX_TARGETS).contains(&boxes.len()) {
            true => Ok(Self(boxes)),
            false => Err(NoBoxes),
        }
    }
}

/// The text is no list of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "`boxes` must be 1 to {MAX_TARGETS} boxes: `x,y,width,height;x,y,width,height` or the JSON array \
     [[1, 2, 30, 40], {{\"x\": 1, \"y\": 2, \"width\": 30, \"height\": 40}}]"
)]
pub struct NoBoxes;

impl FromStr for Boxes {
    type Err = NoBoxes;

    /// Reads `x,y,width,height;x,y,width,height`, or a JSON array of boxes in any notation.
    fn from_str(text: &str) -> Result<Self, NoBoxes> {
        let boxes: Vec<Rect> = match text.starts_with('[') {
            true => serde_json::from_str(text).map_err(|_| NoBoxes)?,
            false => {
                let boxes = text.split(';').map(|text| text.trim().parse());
                boxes.collect::<Result<_, _>>().map_err(|_| NoBoxes)?
            }
        };
        boxes.try_into()
    }
}

/// `x,y,width,height;x,y,width,height`, as in queries.
impl fmt::Display for Boxes {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let texts: Vec<String> = self.0.iter().map(Rect::to_string).collect();
        f.write_str(&texts.join(";"))
    }
}

impl<'de> Deserialize<'de> for Boxes {
    /// Reads the text of a list of boxes.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        text.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Boxes, NoBoxes> {
        text.parse()
    }

    #[test]
    fn a_list_is_read_in_each_notation() {
        let one = |text: &str| text.parse::<Rect>().unwrap();
        let expected = Boxes(vec![one("-1.5,2,30,40"), one("5,6,7,8")]);
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
