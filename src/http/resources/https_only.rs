//! What a service with TLS answers to plain HTTP: the address to use.

use crate::http::problems::problem::Problem;
use axum::extract::Request;
use axum::http::Method;
use axum::http::header::HOST;
use axum::response::{IntoResponse, Redirect, Response};

/// Sends those who read to the same path over TLS. Others have sent what they want done, perhaps with their key, over a
/// line that anybody can read: they are told so, and nothing is done.
pub async fn to_https(request: Request) -> Response {
    let host = request.headers().get(HOST);
    let host = host.and_then(|host| host.to_str().ok());
    let path = request.uri().path_and_query();
    let path = path.map_or("/", |path| path.as_str());
    match (request.method(), host) {
        // It may be another service that listens here tomorrow: a browser is not to remember this.
        (&Method::GET | &Method::HEAD, Some(host)) if !host.is_empty() => {
            Redirect::temporary(&format!("https://{host}{path}")).into_response()
        }
        _ => Problem::malformed("The service speaks TLS: its address begins with https.")
            .into_response(),
    }
}
