//! Settings that are on or off.

use serde::de::{Deserialize, Deserializer, Error};
use std::borrow::Cow;

/// Off, unless it is given: as `name`, `name=true` or `name=1`. Python clients write `True` and `False`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Switch(pub bool);

impl<'de> Deserialize<'de> for Switch {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match &*Cow::<str>::deserialize(deserializer)? {
            "" | "true" | "True" | "1" => Ok(Self(true)),
            "false" | "False" | "0" => Ok(Self(false)),
            _ => Err(D::Error::custom("a switch is `true` or `false`")),
        }
    }
}
