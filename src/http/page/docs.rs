//! `/openapi.json`, and `/docs`: Swagger UI from within the program, so that it needs no other host.

use crate::http::middleware::base_path::BasePath;
use crate::http::middleware::security_headers::DOCS_POLICY;
use crate::http::openapi::document;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::response::{IntoResponse, Redirect, Response};
use std::borrow::Cow;
use std::sync::{Arc, LazyLock};
use utoipa_swagger_ui::Config;

// The default validator is on another host.
static SWAGGER: LazyLock<Arc<Config<'static>>> =
    LazyLock::new(|| Arc::new(Config::new(["../openapi.json"]).validator_url("none")));

/// `/openapi.json` of a service below this path.
pub fn document(base: &BasePath) -> Bytes {
    let document = match base.as_str() {
        "" => document::document(),
        path => document::document_at(path),
    };
    (document + "\n").into()
}

/// `/openapi.json`, as it was made at the start.
pub async fn served(document: Bytes) -> Response {
    ([(CONTENT_TYPE, "application/json")], document).into_response()
}

/// `/docs`: the files of Swagger UI are relative to `/docs/`.
pub async fn redirect() -> Redirect {
    Redirect::to("/docs/")
}

/// `/docs/`.
pub async fn index() -> Result<Response, Problem> {
    file("")
}

/// `/docs/{file}`.
pub async fn asset(path: Result<Path<String>, PathRejection>) -> Result<Response, Problem> {
    let Path(path) = path.map_err(|_| Problem::route_not_found())?;
    file(&path)
}

fn file(path: &str) -> Result<Response, Problem> {
    match utoipa_swagger_ui::serve(path, SWAGGER.clone()) {
        Ok(Some(file)) => {
            // No copy for each answer: a client may leave it unread.
            let bytes = match file.bytes {
                Cow::Borrowed(bytes) => Bytes::from_static(bytes),
                Cow::Owned(bytes) => bytes.into(),
            };
            let headers = [
                (CONTENT_TYPE, file.content_type),
                (CACHE_CONTROL, "max-age=3600".to_owned()),
                (CONTENT_SECURITY_POLICY, DOCS_POLICY.to_owned()),
            ];
            Ok((headers, bytes).into_response())
        }
        Ok(None) => Err(Problem::route_not_found()),
        Err(error) => Err(Problem::internal(Arc::new(std::io::Error::other(
            error.to_string(),
        )))),
    }
}
