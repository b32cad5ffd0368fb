//! When the store in a folder syncs its files to the disk.

use std::str::FromStr;
use std::time::Duration;

/// When what is written is synced, so that it outlives a power cut. A process that is killed loses nothing in either
/// case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// Before the call that wrote it is answered. Answers that are due at the same time share a sync.
    Each,
    /// At least once in this time, from 1 ms to 1 h: a power cut loses no more than what was answered since the last
    /// sync.
    Every(Duration),
}

/// The text is no [`Durability`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("each, or a time from 1ms to 1h, like 250ms")]
pub struct DurabilityError;

impl Default for Durability {
    fn default() -> Self {
        Self::Every(Duration::from_millis(250))
    }
}

impl FromStr for Durability {
    type Err = DurabilityError;

    fn from_str(text: &str) -> Result<Self, DurabilityError> {
        if text == "each" {
            return Ok(Self::Each);
        }
        let time = humantime::parse_duration(text).map_err(|_| DurabilityError)?;
        let range = Duration::from_millis(1)..=Duration::from_secs(3600);
        match range.contains(&time) {
            true => Ok(Self::Every(time)),
            false => Err(DurabilityError),
        }
    }
}

impl std::fmt::Display for Durability {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Each => formatter.write_str("each"),
            Self::Every(time) => write!(formatter, "{}", humantime::format_duration(*time)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_each_or_a_time() {
        for text in ["each", "250ms", "1s"] {
            let read: Durability = text.parse().unwrap();
            assert_eq!(read.to_string(), text);
        }
        for text in ["", "never", "0s", "2h", "250", "Each"] {
            assert!(text.parse::<Durability>().is_err(), "{text}");
        }
    }
}
