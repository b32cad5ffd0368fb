//! Which hosts a request may name, and from which origins a web page may call.
//!
//! Refused are requests that do not name exactly one host, and those that a browser sends for a page of an origin, or
//! under the name of a [host](AllowedHosts), that is not allowed. CORS alone does not do: a browser sends "simple"
//! posts of any page without asking first, and only hides the answer from the page.

use super::client_quotas::{RATE_LIMIT, RATE_LIMIT_POLICY};
use super::response_headers::DRAINING;
use super::trace_context::TRACEPARENT;
use crate::http::extract::instance::{IDEMPOTENCY_KEY, REQUEST_ID};
use crate::http::problems::problem::Problem;
use crate::http::respond::annotated_image::ANSWER;
use crate::http::respond::answer::{CHECKPOINT, REPLAYED};
use crate::http::state::AppState;
use axum::extract::Request;
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, HOST, LOCATION, ORIGIN, RETRY_AFTER};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Version};
use bagtrack_access::AllowedHosts;
use std::time::Duration;
use tower_http::cors::{AllowOrigin, CorsLayer};

/// Refuses requests that do not name exactly one host (RFC 9112, section 3.2): of several, a cache or proxy before the
/// service might take another one than the service does.
pub fn one_host(request: &Request) -> Result<(), Problem> {
    let count = request.headers().get_all(HOST).iter().count();
    let may_lack = request.version() < Version::HTTP_11;
    if count == 1 || (count == 0 && may_lack) {
        return Ok(());
    }
    let detail = format!("A request has one `Host` header, and this one has {count}.");
    Err(Problem::malformed(detail))
}

/// Refuses requests to hosts that are not allowed, and browsers' requests for pages of origins that are not allowed.
pub fn check_origin(state: &AppState, request: &Request) -> Result<(), Problem> {
    let hosts = AllowedHosts::of(&state.config, state.access.is_needed());
    let headers = request.headers();
    let named = request
        .uri()
        .authority()
        .map(|authority| authority.as_str());
    let host = named.or_else(|| text(headers, HOST.as_str())).unwrap_or("");
    if !hosts.have(host) {
        return Err(Problem::host_not_allowed());
    }
    let Some(origin) = headers.get(ORIGIN) else {
        return Ok(());
    };
    let origin = origin.to_str().unwrap_or("");
    // Pages cannot set this header, and a proxy that changes the host leaves it as it is. Over plain HTTP browsers send
    // it to their own machine only.
    let same = match text(headers, "sec-fetch-site") {
        Some(site) => matches!(site, "same-origin" | "none"),
        None => is_same_origin(origin, host),
    };
    let mut allowed = state.config.cors_origins.iter();
    match same || allowed.any(|allowed| allowed == "*" || allowed == origin) {
        true => Ok(()),
        false => Err(Problem::origin_not_allowed()),
    }
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

/// The scheme is not compared: a proxy may have ended TLS.
fn is_same_origin(origin: &str, host: &str) -> bool {
    let authority = origin.split_once("://").map(|(_, authority)| authority);
    authority.is_some_and(|authority| !host.is_empty() && authority.eq_ignore_ascii_case(host))
}

/// How long a browser may keep the answer to a preflight request: the largest value that no browser shortens.
const MAX_AGE: Duration = Duration::from_secs(7200);

/// Tells browsers that pages of the allowed origins may make every call, and pages of other origins none.
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
