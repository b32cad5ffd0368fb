//! Dates, as headers have them.

const MONTHS: [&str; 12] = [
    "Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec",
];

/// The seconds since 1970 of a date like `Sun, 06 Nov 1994 08:49:37 GMT`.
pub fn seconds(text: &str) -> Option<u64> {
    let (_, date) = text.split_once(", ")?;
    let parts: Vec<&str> = date.split([' ', ':']).collect();
    let [day, month, year, hour, minute, second, "GMT"] = parts[..] else {
        return None;
    };
    let number = |part: &str| part.parse::<u16>().ok().map(u64::from);
    let month = MONTHS.iter().position(|name| *name == month)? as u64;
    // A year begins in March, so that the day of a leap year is its last.
    let (year, month) = match month {
        0 | 1 => (number(year)?.checked_sub(1)?, month + 10),
        _ => (number(year)?, month - 2),
    };
    let days = 365 * year + year / 4 - year / 100 + year / 400;
    let days = days + (153 * month + 2) / 5 + number(day)?;
    let time = 60 * (60 * number(hour)? + number(minute)?) + number(second)?;
    Some(86_400 * days.checked_sub(719_469)? + time)
}
