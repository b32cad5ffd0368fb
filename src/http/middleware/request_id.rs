//! The id of a request: the client's `x-request-id` where it can be used, so that a trace can be followed through
//! several services, else a new one.

use axum::extract::Request;
use axum::http::header::HeaderName;
use tower_http::request_id::RequestId;

/// The header of request ids.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
const MAX_ID_BYTES: usize = 64;

/// Middleware that removes an id that is too long or has other characters than ids need: ids are logged and sent back.
pub async fn remove_unusable_id(mut request: Request) -> Request {
    let is_usable = |id: &[u8]| {
        let is_allowed = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.:".contains(byte);
        (1..=MAX_ID_BYTES).contains(&id.len()) && id.iter().all(is_allowed)
    };
    let headers = request.headers_mut();
    if headers
        .get(REQUEST_ID)
        .is_some_and(|id| !is_usable(id.as_bytes()))
    {
        headers.remove(REQUEST_ID);
    }
    request
}

/// The id of a request that has passed the layer that sets it.
pub fn of(request: &Request) -> String {
    let id = request.extensions().get::<RequestId>();
    let id = id.and_then(|id| id.header_value().to_str().ok());
    id.unwrap_or_default().to_owned()
}
