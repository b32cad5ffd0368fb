//! Settings as text, whichever form they came in.

use crate::http::problem::Problem;
use crate::tracker::{Params, Preset, Rect};
use serde_json::{Map, Value};

/// Most bytes of a setting. All parameters together need some hundred.
const MAX_TEXT: usize = 16 << 10;

/// The settings of a request.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fields {
    /// The box of the target.
    pub target: Option<Rect>,
    /// The number of the (first) frame.
    pub number: Option<u64>,
    preset: Option<Preset>,
    seed: Option<u64>,
    params: Option<Map<String, Value>>,
}

impl Fields {
    /// Takes in one setting. JSON values come as their text, strings without their quotes.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), Problem> {
        let text = text.trim();
        if text.len() > MAX_TEXT {
            return Err(Problem::malformed(format!(
                "`{name}` is longer than {MAX_TEXT} bytes."
            )));
        }
        match name {
            "box" => once(&mut self.target, name, parse_box(text)?),
            "frame" => once(&mut self.number, name, parse_whole(name, text)?),
            "seed" => once(&mut self.seed, name, parse_whole(name, text)?),
            "preset" => {
                let preset = serde_json::from_value(Value::from(text))
                    .map_err(|_| Problem::malformed("`preset` must be `paper` or `robust`."))?;
                once(&mut self.preset, name, preset)
            }
            "params" => {
                let params = serde_json::from_str(text).map_err(|_| {
                    Problem::malformed(
                        "`params` must be a JSON object of parameters, like {\"seed\": 7}.",
                    )
                })?;
                once(&mut self.params, name, params)
            }
            other => unreachable!("{other} was checked against the names that the form takes"),
        }
    }

    /// The tracker's parameters: the preset, the seed (a random one when none is given) and the overrides.
    pub fn tracker_params(&self) -> Result<Params, Problem> {
        let preset = self.preset.unwrap_or_default();
        super::params::resolve(preset, self.seed, self.params.as_ref())
    }

    /// Whether anything that a snapshot already holds is set.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

fn once<T>(field: &mut Option<T>, name: &str, value: T) -> Result<(), Problem> {
    if field.replace(value).is_some() {
        return Err(Problem::malformed(format!(
            "`{name}` is given twice; give it once."
        )));
    }
    Ok(())
}

fn parse_whole(name: &str, text: &str) -> Result<u64, Problem> {
    text.parse().map_err(|_| {
        Problem::malformed(format!(
            "`{name}` must be a whole number from 0 to {}.",
            u64::MAX
        ))
    })
}

/// `x,y,width,height`, a JSON object with these names, or a JSON array in this order.
fn parse_box(text: &str) -> Result<Rect, Problem> {
    let parsed = if text.starts_with('{') {
        serde_json::from_str(text).ok()
    } else {
        let list = text
            .strip_prefix('[')
            .and_then(|text| text.strip_suffix(']'));
        parse_list(list.unwrap_or(text))
    };
    parsed.ok_or_else(|| {
        Problem::malformed(
            "`box` must be four numbers `x,y,width,height` or the object {\"x\": 1, \"y\": 2, \"width\": 30, \"height\": 40}.",
        )
    })
}

fn parse_list(text: &str) -> Option<Rect> {
    let numbers = text.split(',').map(|number| number.trim().parse::<f64>());
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().ok()?;
    match numbers[..] {
        [x, y, width, height] if numbers.iter().all(|n| n.is_finite()) => Some(Rect {
            x,
            y,
            width,
            height,
        }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_read_in_each_notation() {
        let expected = Rect {
            x: -1.5,
            y: 2.0,
            width: 30.0,
            height: 4e1,
        };
        for text in [
            "-1.5,2,30,40",
            " -1.5, 2 ,30 , 40 ",
            "[-1.5, 2, 30, 40]",
            r#"{"x": -1.5, "y": 2, "width": 30, "height": 40}"#,
        ] {
            assert_eq!(parse_box(text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn what_is_no_box_is_refused() {
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
            assert!(parse_box(text).is_err(), "{text}");
        }
    }
}
