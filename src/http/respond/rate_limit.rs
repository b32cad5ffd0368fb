//! The quotas of a client in the headers `RateLimit-Policy` and `RateLimit`
//! (draft-ietf-httpapi-ratelimit-headers).

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use bagtrack_quotas::Account;

/// The header with what is left of a client's quotas.
pub const RATE_LIMIT: HeaderName = HeaderName::from_static("ratelimit");
/// The header with a client's quotas.
pub const RATE_LIMIT_POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");

/// Tells a client its quotas and what is left of them.
pub fn write_headers(account: &Account, headers: &mut HeaderMap) {
    let (requests, requests_left) = account.requests();
    let (sessions, sessions_left) = account.sessions();
    let mut policy = format!(
        "\"requests\";q={requests};qu=\"concurrent-requests\", \"sessions\";q={sessions};qu=\"sessions\""
    );
    let mut left = format!("\"requests\";r={requests_left}, \"sessions\";r={sessions_left}");
    if let Some(((rate, burst), frames_left)) = account.frames() {
        let window = burst.get().div_ceil(rate.get());
        policy += &format!(", \"frames\";q={burst};w={window};qu=\"frames\"");
        left += &format!(", \"frames\";r={frames_left};t={window}");
    }
    for (name, value) in [(RATE_LIMIT_POLICY, policy), (RATE_LIMIT, left)] {
        if let Ok(value) = HeaderValue::from_str(&value) {
            headers.insert(name, value);
        }
    }
}
