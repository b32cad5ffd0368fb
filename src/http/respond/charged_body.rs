//! Bodies that own their memory: it is charged until the client has taken it.

use axum::body::Bytes;
use axum::http::HeaderName;
use axum::http::header::CONTENT_TYPE;
use bagtrack_sessions::{Charge, ChargedBytes};

/// A body with its media type.
pub type ChargedBody = ([(HeaderName, &'static str); 1], Bytes);

pub fn charged_body(
    media_type: &'static str,
    bytes: impl AsRef<[u8]> + Send + 'static,
    charge: Charge,
) -> ChargedBody {
    let body = Bytes::from(ChargedBytes::new(bytes, charge));
    ([(CONTENT_TYPE, media_type)], body)
}
