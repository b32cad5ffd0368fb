//! The path of the service on a host that it shares with others.

use std::fmt;
use std::str::FromStr;

/// A path like `/tracker`, or none. It has no slash at its end.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BasePath(String);

/// The text is no base path.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a base path is like /tracker or /video/tracker: letters, digits, and -._~")]
pub struct BasePathError;

impl BasePath {
    /// The path, empty where there is none.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The rest of `path` below this one; `None` where `path` is not below it.
    pub fn below<'a>(&self, path: &'a str) -> Option<&'a str> {
        let rest = path.strip_prefix(&self.0)?;
        (rest.is_empty() || rest.starts_with('/')).then_some(rest)
    }
}

impl FromStr for BasePath {
    type Err = BasePathError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let path = text.strip_suffix('/').unwrap_or(text);
        let plain = |c: char| c.is_ascii_alphanumeric() || "-._~".contains(c);
        let name = |part: &str| part.starts_with(|c: char| c != '.') && part.chars().all(plain);
        let mut parts = path.split('/');
        match parts.next() == Some("") && parts.all(name) {
            true => Ok(Self(path.to_owned())),
            false => Err(BasePathError),
        }
    }
}

impl fmt::Display for BasePath {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}
