//! The smoothstep function.

/// Rises from 0 at `at` = 0 to 1 at `at` = 1 as 3 at² - 2 at³, so with no slope at either end; constant beyond them.
pub(super) fn smoothstep(at: f64) -> f64 {
    let at = at.clamp(0.0, 1.0);
    at * at * (3.0 - 2.0 * at)
}
