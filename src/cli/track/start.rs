//! `--start`: the frame in which the boxes hold.

/// The frame in which the boxes hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// By its number, from 0.
    Frame(u64),
    /// By its time: the first frame that is not before this many seconds.
    Time(f64),
}

const USAGE: &str =
    "it must be the number of a frame, counted from 0, or a time like 12.5s, 1:30 or 0:01:30";

/// Reads `120`, `12.5s`, `1:30`, `0:01:30.5`.
///
/// # Errors
/// The text has none of these forms.
pub fn parse(text: &str) -> Result<Start, String> {
    if let Ok(frame) = text.parse() {
        return Ok(Start::Frame(frame));
    }
    let seconds = match text.strip_suffix('s') {
        Some(number) => number_of(number),
        None if text.contains(':') => clock(text),
        None => None,
    };
    seconds.map(Start::Time).ok_or_else(|| USAGE.to_owned())
}

/// The seconds of `minutes:seconds` or `hours:minutes:seconds`, in which all parts but the first are below 60.
fn clock(text: &str) -> Option<f64> {
    let mut parts = text.split(':');
    let first: u32 = parts.next()?.parse().ok()?;
    let mut seconds = f64::from(first);
    let rest: Vec<&str> = parts.collect();
    let (last, middle) = rest.split_last()?;
    for minutes in middle {
        let minutes: u32 = minutes.parse().ok().filter(|minutes| *minutes < 60)?;
        seconds = 60.0 * seconds + f64::from(minutes);
    }
    let last = number_of(last).filter(|last| *last < 60.0)?;
    (rest.len() <= 2).then_some(60.0 * seconds + last)
}

/// A number that is not negative, without a sign or an exponent.
fn number_of(text: &str) -> Option<f64> {
    let is_plain = text.chars().all(|c| c.is_ascii_digit() || c == '.');
    text.parse().ok().filter(|_| is_plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_number_is_a_frame_and_the_rest_are_times() {
        for (text, expected) in [
            ("0", Start::Frame(0)),
            ("120", Start::Frame(120)),
            ("12s", Start::Time(12.0)),
            ("12.5s", Start::Time(12.5)),
            ("1:30", Start::Time(90.0)),
            ("90:00.25", Start::Time(5400.25)),
            ("1:02:03.5", Start::Time(3723.5)),
        ] {
            assert_eq!(parse(text), Ok(expected), "{text}");
        }
        for text in [
            "", "-1", "1.5", "s", "-1s", "1e3s", "infs", "1:60", "1:61:00", "1:", ":1", "1:2:3:4",
            "end",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
