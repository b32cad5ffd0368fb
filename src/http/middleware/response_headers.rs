//! Header fields of every answer: what browsers may do with it, and whether the service is about to end.

use crate::http::state::AppState;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
    X_FRAME_OPTIONS,
};
use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;

/// The policy of answers without one of their own: they load nothing, and no page frames them. All others begin so.
pub const STRICT: &str =
    "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The page at `/` may load its own style sheet, scripts, worker with WebAssembly and pictures, and files that the user
/// opens; and call this service.
pub const PAGE_POLICY: &str = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; \
    script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
    media-src blob:; connect-src 'self'";

/// Swagger UI may load its own files, have styles within its elements, and call this service.
pub const DOCS_POLICY: &str = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; \
    script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self'; \
    connect-src 'self'";

/// Headers of every answer, against misuse by web pages.
pub const HEADERS: [(HeaderName, &str); 5] = [
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (X_FRAME_OPTIONS, "DENY"),
    (REFERRER_POLICY, "no-referrer"),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
];

/// Sets [`HEADERS`] on an answer. Without values of its own it gets the policy [`STRICT`], and no cache keeps it.
pub fn secure(response: &mut Response) {
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    let strict = HeaderValue::from_static(STRICT);
    headers.entry(CONTENT_SECURITY_POLICY).or_insert(strict);
    let no_store = HeaderValue::from_static("no-store");
    headers.entry(CACHE_CONTROL).or_insert(no_store);
}

pub const DRAINING: HeaderName = HeaderName::from_static(bagtrack_api::headers::DRAINING);

/// Marks the answers of a service that is about to end with `Draining: true`, so that clients take their sessions
/// elsewhere in time.
pub fn mark_draining(state: &AppState, response: &mut Response) {
    if state.is_draining() {
        let marked = HeaderValue::from_static("true");
        response.headers_mut().insert(DRAINING, marked);
    }
}
