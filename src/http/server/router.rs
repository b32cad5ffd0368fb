//! All routes, and the layers that every request passes through.

use crate::http::extract::instance::Instance;
use crate::http::middleware::answer_problems::panic_response;
use crate::http::middleware::base_path::mount;
use crate::http::middleware::chain::{
    every_request, metrics_request, page_request, session_request,
};
use crate::http::middleware::host_and_origin::cors;
use crate::http::page::docs;
use crate::http::page::sample_clips;
use crate::http::page::static_files;
use crate::http::problems::problem::Problem;
use crate::http::resources::routes;
use crate::http::state::AppState;
use axum::Router;
use axum::extract::DefaultBodyLimit;
#[cfg(feature = "tls")]
use axum::extract::Request;
use axum::http::HeaderMap;
use axum::http::header::CONNECTION;
#[cfg(feature = "tls")]
use axum::http::{Method, header::HOST};
use axum::middleware;
use axum::response::Response;
#[cfg(feature = "tls")]
use axum::response::{IntoResponse, Redirect};
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;

/// The whole service. `extra` routes are served beside its own. They pass through the layers of all requests, and not
/// through those of [`routes`], which say who may use the service.
pub fn router(state: AppState, extra: Router) -> Router {
    let routes = routes(&state)
        .with_state(state.clone())
        .merge(extra)
        .fallback(async |instance: Instance| Problem::no_route(&instance.path))
        .method_not_allowed_fallback(async || Problem::method_not_allowed());
    mount(&state.config.base_path, with_layers(routes, &state))
}

/// The routes for connections over the share of their address: the probes, since a supervisor ends a service that does
/// not answer them. Other requests get [`Problem::too_many_connections`]. A connection closes after one answer, so that
/// no client keeps its place.
pub fn probes_only(state: &AppState) -> Router {
    let (probes, _) = routes::probes().split_for_parts();
    let refuse = async || Problem::too_many_connections();
    let routes = probes.with_state(state.clone()).fallback(refuse);
    let close = async |response: Response| ([(CONNECTION, "close")], response);
    let routes = routes.layer(middleware::map_response(close));
    mount(&state.config.base_path, with_layers(routes, state))
}

/// The routes for requests in plain HTTP where TLS is expected.
#[cfg(feature = "tls")]
pub fn https_only(state: &AppState) -> Router {
    with_layers(Router::new().fallback(to_https), state)
}

/// The layers that every request passes through: the first is the first to see it.
fn with_layers(routes: Router, state: &AppState) -> Router {
    routes.layer((
        middleware::from_fn_with_state(state.clone(), every_request),
        CatchPanicLayer::custom(panic_response),
        cors(&state.config.cors_origins),
        DefaultBodyLimit::max(state.config.max_body_bytes),
    ))
}

/// The routes of the service, each behind the checks of who may use it. Only the probes are behind none: they have no
/// key, and their `Host` is the address of the machine.
fn routes(state: &AppState) -> Router<AppState> {
    let of_page = middleware::from_fn_with_state(state.clone(), page_request);
    let of_sessions = middleware::from_fn_with_state(state.clone(), session_request);
    let of_metrics = middleware::from_fn_with_state(state.clone(), metrics_request);
    let document = docs::document(match state.config.base_path.as_str() {
        "" => routes::document(),
        path => routes::document_at(path),
    });
    let (sessions, _) = routes::sessions().split_for_parts();
    let (metrics, _) = routes::metrics().split_for_parts();
    let (version, _) = routes::version().split_for_parts();
    let (probes, _) = routes::probes().split_for_parts();
    let pages = Router::new()
        .route("/", get(static_files::index))
        .route("/page/{*file}", get(static_files::asset));
    let pages = pages
        .route("/sample/{clip}/clip.json", get(sample_clips::view))
        .route("/sample/{clip}/{frame}", get(sample_clips::frame));
    pages
        .route(
            "/openapi.json",
            get(move |headers: HeaderMap| docs::served(document.clone(), headers)),
        )
        .route("/docs/problems", get(docs::problems))
        .merge(version)
        .route("/docs", get(docs::redirect))
        .route("/docs/", get(docs::index))
        .route("/docs/{*path}", get(docs::asset))
        .route_layer(of_page)
        .merge(sessions.route_layer(of_sessions))
        .merge(metrics.route_layer(of_metrics))
        .merge(probes)
}

/// Redirects GET and HEAD to the same path over TLS. Other requests are refused: the client has sent data, perhaps with
/// its key, over a line that anybody can read, and has to learn of that.
#[cfg(feature = "tls")]
async fn to_https(request: Request) -> Response {
    let host = request.headers().get(HOST);
    let host = host.and_then(|host| host.to_str().ok());
    let path = request.uri().path_and_query();
    let path = path.map_or("/", |path| path.as_str());
    match (request.method(), host) {
        // Temporary, so that browsers do not remember the redirect: another service may listen here one day.
        (&Method::GET | &Method::HEAD, Some(host)) if !host.is_empty() => {
            Redirect::temporary(&format!("https://{host}{path}")).into_response()
        }
        _ => Problem::malformed("The service speaks TLS: its address begins with https.")
            .into_response(),
    }
}
