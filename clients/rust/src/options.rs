//! The options of a new session.

use crate::transport::Query;
use bagtrack_api::{PresetName, Rect};
use serde_json::{Map, Value};

/// The targets to follow: a `Rect`, or several in a `Vec` or an array, in pixels of the first frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Targets {
    /// One target.
    One(Rect),
    /// Up to 16 targets. Answers have `targets`, in this order.
    List(Vec<Rect>),
}

impl From<Rect> for Targets {
    fn from(rect: Rect) -> Self {
        Self::One(rect)
    }
}

impl From<Vec<Rect>> for Targets {
    fn from(rects: Vec<Rect>) -> Self {
        Self::List(rects)
    }
}

impl<const N: usize> From<[Rect; N]> for Targets {
    fn from(rects: [Rect; N]) -> Self {
        Self::List(rects.to_vec())
    }
}

impl Targets {
    fn query(&self) -> (&'static str, String) {
        match self {
            Self::One(rect) => ("box", rect.to_string()),
            Self::List(rects) => {
                let texts: Vec<String> = rects.iter().map(Rect::to_string).collect();
                ("boxes", texts.join(";"))
            }
        }
    }
}

/// The tracker's settings; the service's defaults apply to those that are not set.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpenOptions {
    preset: Option<PresetName>,
    seed: Option<u64>,
    parameters: Map<String, Value>,
}

impl OpenOptions {
    /// Options with nothing set.
    pub fn new() -> Self {
        Self::default()
    }

    /// The preset.
    pub fn preset(mut self, preset: PresetName) -> Self {
        self.preset = Some(preset);
        self
    }

    /// The seed of all random draws: the same frames, box and seed give the same boxes. Without it, the service draws a
    /// seed.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Changes a parameter of the preset: `parameter("bag_size", 5)`.
    pub fn parameter(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.parameters.insert(name.to_owned(), value.into());
        self
    }

    pub(crate) fn query(&self, targets: &Targets) -> Query {
        let preset = self.preset.map(|preset| match preset {
            PresetName::Robust => "robust",
            PresetName::Paper => "paper",
        });
        let parameters = &self.parameters;
        let parameters = (!parameters.is_empty()).then(|| Value::from(parameters.clone()));
        let optional = [
            ("preset", preset.map(str::to_owned)),
            ("seed", self.seed.map(|seed| seed.to_string())),
            ("parameters", parameters.map(|value| value.to_string())),
        ];
        let optional = optional.into_iter();
        let set = optional.filter_map(|(name, value)| Some((name, value?)));
        [targets.query()].into_iter().chain(set).collect()
    }
}
