//! Which pages of other origins may call.

use super::client_quotas::{RATE_LIMIT, RATE_LIMIT_POLICY};
use super::response_headers::DRAINING;
use super::trace_context::TRACEPARENT;
use crate::http::extract::idempotency_key::IDEMPOTENCY_KEY;
use crate::http::extract::instance::REQUEST_ID;
use crate::http::respond::annotated_image::ANSWER;
use crate::http::respond::answer::{CHECKPOINT, REPLAYED};
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, LOCATION, RETRY_AFTER};
use axum::http::{HeaderName, HeaderValue, Method};
use std::time::Duration;
use tower_http::cors::{AllowOrigin, CorsLayer};

/// How long a browser need not ask again. The largest that all of them keep to.
const MAX_AGE: Duration = Duration::from_secs(7200);

/// Pages of the allowed origins may make every call; pages of other origins none.
pub fn cors(origins: &[String]) -> CorsLayer {
    let allowed = if origins.iter().any(|origin| origin == "*") {
        AllowOrigin::any()
    } else {
        let values = origins.iter().map(|origin| HeaderValue::from_str(origin));
        AllowOrigin::list(values.filter_map(Result::ok))
    };
    let name = HeaderName::from_static;
    CorsLayer::new()
        .allow_origin(allowed)
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers([
            AUTHORIZATION,
            CONTENT_TYPE,
            REQUEST_ID,
            TRACEPARENT,
            name("tracestate"),
            name(IDEMPOTENCY_KEY),
        ])
        .expose_headers([
            LOCATION,
            RETRY_AFTER,
            REQUEST_ID,
            TRACEPARENT,
            DRAINING,
            RATE_LIMIT,
            RATE_LIMIT_POLICY,
            REPLAYED,
            CHECKPOINT,
            ANSWER,
        ])
        .max_age(MAX_AGE)
}
