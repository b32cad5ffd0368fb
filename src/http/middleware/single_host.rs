//! Refuses requests that do not name one host (RFC 9112, section 3.2): caches and proxies before the service might take
//! another one of several.

use crate::http::problems::problem::Problem;
use axum::extract::Request;
use axum::http::Version;
use axum::http::header::HOST;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

/// The middleware.
pub async fn one_host(request: Request, next: Next) -> Response {
    let count = request.headers().get_all(HOST).iter().count();
    let may_lack = request.version() < Version::HTTP_11;
    if count == 1 || (count == 0 && may_lack) {
        return next.run(request).await;
    }
    let detail = format!("A request has one `Host` header, and this one has {count}.");
    Problem::malformed(detail).into_response()
}
