//! The header `Idempotency-Key`.

use crate::http::problems::problem::Problem;
use axum::http::HeaderMap;

pub const IDEMPOTENCY_KEY: &str = "idempotency-key";
const MAX_KEY_BYTES: usize = 255;

/// The key of a request.
///
/// # Errors
/// There is more than one, or it is empty, too long, or not visible ASCII.
pub fn key_of(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let mut values = headers.get_all(IDEMPOTENCY_KEY).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    let text = value.to_str().unwrap_or("");
    let usable = (1..=MAX_KEY_BYTES).contains(&text.len())
        && text.bytes().all(|byte| byte.is_ascii_graphic());
    match usable && values.next().is_none() {
        true => Ok(Some(text.to_owned())),
        false => Err(Problem::malformed(
            "`Idempotency-Key` must be given once, with 1 to 255 visible ASCII characters.",
        )),
    }
}
