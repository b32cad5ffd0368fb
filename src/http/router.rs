//! All routes, and the layers that every request passes through.

use super::answer_problems::{answer_problems, panic_response};
use super::api::api;
use super::drain::drain_refused;
use super::host::one_host;
use super::identify::identify;
use super::problems::problem::Problem;
use super::request_id::{self, REQUEST_ID, remove_unusable_id};
use super::state::AppState;
use super::{docs, page};
use axum::Router;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_TYPE, LOCATION, RETRY_AFTER, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderName, HeaderValue, Method};
use axum::middleware;
use axum::response::Response;
use axum::routing::get;
use std::time::Duration;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::cors::{AllowOrigin, CorsLayer};
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::RequestBodyDeadlineLayer;
use tower_http::trace::TraceLayer;
use tracing::Span;

/// Bytes of a path that are logged.
const MAX_LOGGED_PATH: usize = 200;

/// The whole service. `extra` routes are served beside its own and pass through the same layers.
pub fn router(state: AppState, extra: Router) -> Router {
    let (api, _) = api().split_for_parts();
    let config = &state.config;
    api.route("/", get(page::index))
        .route("/openapi.json", get(docs::document))
        .route("/docs", get(docs::redirect))
        .route("/docs/", get(docs::index))
        .route("/docs/{*path}", get(docs::asset))
        .with_state(state.clone())
        .merge(extra)
        .fallback(async || Problem::route_not_found())
        .method_not_allowed_fallback(async || Problem::method_not_allowed())
        // The last layer is the first to see a request.
        .layer(middleware::from_fn_with_state(state.clone(), identify))
        .layer(DefaultBodyLimit::max(config.max_body_bytes))
        .layer(middleware::from_fn_with_state(state.clone(), drain_refused))
        .layer(RequestBodyDeadlineLayer::new(config.body_timeout))
        .layer(cors(&config.cors_origins))
        .layer(middleware::from_fn(one_host))
        .layer(CatchPanicLayer::custom(panic_response))
        .layer(middleware::from_fn(answer_problems))
        .layer(SetResponseHeaderLayer::if_not_present(
            CACHE_CONTROL,
            HeaderValue::from_static("no-store"),
        ))
        .layer(SetResponseHeaderLayer::overriding(
            X_CONTENT_TYPE_OPTIONS,
            HeaderValue::from_static("nosniff"),
        ))
        .layer(
            TraceLayer::new_for_http()
                .make_span_with(request_span)
                .on_request(())
                .on_response(log_answer)
                .on_eos(())
                // A status from 500 on is no failure of its own: the problem has been logged.
                .on_failure(()),
        )
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(middleware::map_request(remove_unusable_id))
}

/// The span of a request in the log: never bytes or boxes, and no more of the path than any route has.
fn request_span(request: &Request) -> Span {
    let (id, path) = (request_id::of(request), request.uri().path());
    let path = path.get(..MAX_LOGGED_PATH).unwrap_or(path);
    tracing::info_span!("request", id, method = %request.method(), path)
}

fn log_answer<B>(response: &Response<B>, latency: Duration, _span: &Span) {
    let status = response.status().as_u16();
    tracing::info!(status, ms = latency.as_secs_f64() * 1e3, "answered");
}

/// Pages of the allowed origins may make every call; pages of other origins none.
fn cors(origins: &[String]) -> CorsLayer {
    let allowed = if origins.iter().any(|origin| origin == "*") {
        AllowOrigin::any()
    } else {
        let values = origins.iter().map(|origin| HeaderValue::from_str(origin));
        AllowOrigin::list(values.filter_map(Result::ok))
    };
    let replayed = HeaderName::from_static("replayed");
    CorsLayer::new()
        .allow_origin(allowed)
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers([CONTENT_TYPE, REQUEST_ID])
        .expose_headers([LOCATION, RETRY_AFTER, REQUEST_ID, replayed])
}
