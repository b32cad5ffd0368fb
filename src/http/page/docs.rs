//! `/openapi.json`, `/docs/problems`, and `/docs`: Swagger UI from within the program, so that it needs no other host.

use super::static_file::StaticFile;
use crate::http::middleware::response_headers::{DOCS_POLICY, STRICT};
use crate::http::problems::page;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::HeaderMap;
use axum::response::{Redirect, Response};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use utoipa_swagger_ui::Config;

// Swagger UI's default validator would be on another host.
static SWAGGER: LazyLock<Arc<Config<'static>>> =
    LazyLock::new(|| Arc::new(Config::new(["../openapi.json"]).validator_url("none")));

/// The files of Swagger UI that were asked for, by their paths.
static FILES: Mutex<BTreeMap<String, Arc<StaticFile>>> = Mutex::new(BTreeMap::new());

static PROBLEMS: LazyLock<Arc<StaticFile>> = LazyLock::new(|| {
    let html = "text/html; charset=utf-8";
    StaticFile::new(html, DOCS_POLICY, "no-cache", page::page().into())
});

/// `/openapi.json` with this text.
pub fn document(document: String) -> Arc<StaticFile> {
    let bytes = (document + "\n").into();
    StaticFile::new("application/json", STRICT, "no-cache", bytes)
}

/// `/openapi.json`, as it was made at the start.
pub async fn served(document: Arc<StaticFile>, headers: HeaderMap) -> Response {
    document.respond(&headers).await
}

/// Redirects `/docs` to `/docs/`, since the links of Swagger UI are relative to `/docs/`.
pub async fn redirect() -> Redirect {
    Redirect::to("/docs/")
}

/// `/docs/problems`: where the types of problems lead to.
pub async fn problems(headers: HeaderMap) -> Response {
    PROBLEMS.respond(&headers).await
}

/// `/docs/`.
pub async fn index(headers: HeaderMap) -> Result<Response, Problem> {
    Ok(file("")?.respond(&headers).await)
}

/// `/docs/{file}`.
pub async fn asset(
    path: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Path(path) = path.map_err(|_| Problem::route_not_found())?;
    Ok(file(&path)?.respond(&headers).await)
}

/// A file of Swagger UI. A path without a file leaves no entry in [`FILES`], so that clients cannot fill the memory.
fn file(path: &str) -> Result<Arc<StaticFile>, Problem> {
    // Nothing panics while the lock is held.
    let mut files = FILES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(file) = files.get(path) {
        return Ok(file.clone());
    }
    let found = utoipa_swagger_ui::serve(path, SWAGGER.clone());
    let found = found.map_err(|error| {
        let cause = std::io::Error::other(error.to_string());
        Problem::internal(Arc::new(cause))
    })?;
    let found = found.ok_or_else(Problem::route_not_found)?;
    let bytes = match found.bytes {
        Cow::Borrowed(bytes) => Bytes::from_static(bytes),
        Cow::Owned(bytes) => bytes.into(),
    };
    let file = StaticFile::new(found.content_type, DOCS_POLICY, "max-age=3600", bytes);
    files.insert(path.to_owned(), file.clone());
    Ok(file)
}
