//! `--base-path`: the service below a path of a host that it shares with others.
//!
//! A proxy may take the base path off requests or leave it, so the service takes requests with it and without it.
//! Answers name it in `Location`, in the instance of a problem, and as the server of the OpenAPI document.

use crate::http::extract::instance::ClientPath;
use axum::Router;
use axum::extract::{Request, State};
use axum::http::header::LOCATION;
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderValue, Uri};
use axum::middleware::{self, Next};
use axum::response::Response;
use bagtrack_config::BasePath;

/// Serves these routes below the base path, too.
pub fn mount(base: &BasePath, routes: Router) -> Router {
    if base.as_str().is_empty() {
        return routes;
    }
    // A layer around a fallback runs before a route is looked for, so that it can take the base path off.
    let outer = Router::new().fallback_service(routes);
    outer.layer(middleware::from_fn_with_state(base.clone(), take_off))
}

async fn take_off(State(base): State<BasePath>, mut request: Request, next: Next) -> Response {
    let path = request.uri().path();
    let (rest, whole) = match base.below(path) {
        Some(rest) => (rest, path.to_owned()),
        None => (path, format!("{base}{path}")),
    };
    let query = request.uri().query();
    let slash = if rest.is_empty() { "/" } else { "" };
    let rest = match query {
        Some(query) => format!("{slash}{rest}?{query}"),
        None => format!("{slash}{rest}"),
    };
    if let Ok(rest) = PathAndQuery::from_maybe_shared(rest) {
        let mut parts = request.uri().clone().into_parts();
        parts.path_and_query = Some(rest);
        if let Ok(uri) = Uri::from_parts(parts) {
            *request.uri_mut() = uri;
        }
    }
    request.extensions_mut().insert(ClientPath(whole));
    let mut response = next.run(request).await;
    if let Some(location) = response.headers_mut().get_mut(LOCATION)
        && location.as_bytes().starts_with(b"/")
        && let Ok(path) = location.to_str().map(|path| format!("{base}{path}"))
        && let Ok(path) = HeaderValue::from_str(&path)
    {
        *location = path;
    }
    response
}
