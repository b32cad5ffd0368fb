//! Header fields of every answer: what browsers may do with it, and whether the service is about to end.

use crate::http::state::AppState;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
    X_FRAME_OPTIONS,
};
use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;

/// What a policy has to begin with that a page sets for itself. Nothing may be loaded, and no page may frame it.
pub const STRICT: &str =
    "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The page at `/`: its own style sheet, scripts, worker with WebAssembly and pictures, files that the user opens, and
/// calls to this service.
pub const PAGE_POLICY: &str = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; \
    script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
    media-src blob:; connect-src 'self'";

/// Swagger UI: its own files, styles within its elements, and calls to this service.
pub const DOCS_POLICY: &str = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; \
    script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self'; \
    connect-src 'self'";

/// What every answer has against misuse by pages.
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

/// Sets them on an answer, which is kept by no cache unless it says so itself. A page may have a policy of its own.
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
