//! All routes, and what every request passes through.

use super::context::{REQUEST_ID, panic_response, request_context};
use super::drain::drain_refused;
use super::openapi::Api;
use super::problem::Problem;
use super::state::AppState;
use super::{create, docs, frames, health, page, session, snapshot, target};
use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::header::{CONTENT_TYPE, LOCATION, RETRY_AFTER};
use axum::http::{HeaderName, HeaderValue, Method};
use axum::middleware;
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::cors::{AllowOrigin, CorsLayer};
use tower_http::timeout::RequestBodyDeadlineLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// The routes that are in the OpenAPI document.
pub fn api() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(Api::openapi())
        .routes(routes!(create::create))
        .routes(routes!(session::get, session::delete))
        .routes(routes!(frames::post))
        .routes(routes!(target::put))
        .routes(routes!(snapshot::get))
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
}

/// The whole service; `extra` routes are served beside its own and pass through the same layers.
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
        // The last one is the first to see a request.
        .layer(DefaultBodyLimit::max(config.max_body_bytes))
        .layer(middleware::from_fn_with_state(state.clone(), drain_refused))
        .layer(RequestBodyDeadlineLayer::new(config.body_timeout))
        .layer(cors(&config.cors_origins))
        .layer(CatchPanicLayer::custom(panic_response))
        .layer(middleware::from_fn(request_context))
}

/// What pages of other origins may do: all, or nothing when none is allowed.
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
