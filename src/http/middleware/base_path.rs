//! `--base-path`: the service below a path of a host that it shares with others.
//!
//! A proxy may take the path off requests or leave it, so requests are taken with it and without it. What the service
//! answers has it: `Location`, the instance of a problem, the server of the OpenAPI document.

use axum::Router;
use axum::extract::{Request, State};
use axum::http::header::LOCATION;
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderValue, Uri};
use axum::middleware::{self, Next};
use axum::response::Response;
use std::fmt;
use std::str::FromStr;

/// A path like `/tracker`, or none. It has no slash at its end.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BasePath(String);

/// A text is no base path.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a base path is like /tracker or /video/tracker: letters, digits, and -._~")]
pub struct BasePathError;

/// The path of a request as its client knows it.
#[derive(Debug, Clone)]
struct ClientPath(String);

impl BasePath {
    /// The path, empty where there is none.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The rest of a path below this one.
    fn below<'a>(&self, path: &'a str) -> Option<&'a str> {
        let rest = path.strip_prefix(&self.0)?;
        (rest.is_empty() || rest.starts_with('/')).then_some(rest)
    }
}

impl FromStr for BasePath {
    type Err = BasePathError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let path = text.strip_suffix('/').unwrap_or(text);
        let plain = |c: char| c.is_ascii_alphanumeric() || "-._~".contains(c);
        let name = |part: &str| part.starts_with(|c: char| c != '.') && part.chars().all(plain);
        let mut parts = path.split('/');
        match parts.next() == Some("") && parts.all(name) {
            true => Ok(Self(path.to_owned())),
            false => Err(BasePathError),
        }
    }
}

impl fmt::Display for BasePath {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Serves these routes below the base path, too.
pub fn mount(base: &BasePath, routes: Router) -> Router {
    if base.0.is_empty() {
        return routes;
    }
    // The path is taken off before a route is looked for.
    let outer = Router::new().fallback_service(routes);
    outer.layer(middleware::from_fn_with_state(base.clone(), take_off))
}

/// The path of a request as its client knows it, with the base path.
pub fn client_path(request: &Request) -> String {
    let known = request.extensions().get::<ClientPath>();
    known.map_or_else(|| request.uri().path().to_owned(), |path| path.0.clone())
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
