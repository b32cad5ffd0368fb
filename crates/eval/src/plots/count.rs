//! Numbers with their nouns.

/// "1 seed", "2 seeds".
pub(super) fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
