//! Files that are part of the program, compressed with gzip for clients that take that.
//!
//! Each file is compressed once, when a client first takes it with gzip, and then kept. An entity tag tells whether a
//! browser has the file already. The tag is weak, since the plain and the compressed file share it.

use crate::http::extract::answer_form::{MAX_ITEMS, qualities};
use axum::body::Bytes;
use axum::http::header::{
    ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG,
    IF_NONE_MATCH, VARY,
};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use std::sync::{Arc, OnceLock};
use zlib_rs::{DeflateConfig, ReturnCode, compress_bound, compress_slice};

/// The `window_bits` of zlib: 15 for a window of 32 KiB, and 16 for a gzip header and trailer.
const GZIP: i32 = 15 + 16;
/// Smaller files hardly shrink.
const MIN_BYTES: usize = 1024;

/// A file that is part of the program.
#[derive(Debug)]
pub struct StaticFile {
    media_type: String,
    policy: &'static str,
    cache_control: &'static str,
    tag: String,
    bytes: Bytes,
    gzip: OnceLock<Option<Bytes>>,
}

impl StaticFile {
    /// A file with this content security policy and cache control.
    pub fn new(
        media_type: impl Into<String>,
        policy: &'static str,
        cache_control: &'static str,
        bytes: Bytes,
    ) -> Arc<Self> {
        Arc::new(Self {
            media_type: media_type.into(),
            policy,
            cache_control,
            tag: format!("\"{:032x}\"", xxhash_rust::xxh3::xxh3_128(&bytes)),
            bytes,
            gzip: OnceLock::new(),
        })
    }

    /// The answer to a request with these headers.
    pub async fn respond(self: &Arc<Self>, headers: &HeaderMap) -> Response {
        let common = [
            (CONTENT_SECURITY_POLICY, self.policy.to_owned()),
            (CACHE_CONTROL, self.cache_control.to_owned()),
            (ETAG, format!("W/{}", self.tag)),
            (VARY, "accept-encoding".to_owned()),
        ];
        if self.is_known(headers) {
            return (StatusCode::NOT_MODIFIED, common).into_response();
        }
        let kind = [(CONTENT_TYPE, self.media_type.clone())];
        let gzip = match takes_gzip(headers) {
            true => self.compressed().await,
            false => None,
        };
        match gzip {
            Some(gzip) => (common, kind, [(CONTENT_ENCODING, "gzip")], gzip).into_response(),
            None => (common, kind, self.bytes.clone()).into_response(),
        }
    }

    /// Whether `If-None-Match` names this file, so that the client has it already.
    fn is_known(&self, headers: &HeaderMap) -> bool {
        let values = headers.get_all(IF_NONE_MATCH).into_iter();
        let texts = values.filter_map(|value| value.to_str().ok());
        let tags = texts.flat_map(|text| text.split(',')).take(MAX_ITEMS);
        tags.map(str::trim)
            .any(|tag| tag == "*" || tag.strip_prefix("W/").unwrap_or(tag) == self.tag)
    }

    /// The file compressed with gzip; `None` where that is no smaller.
    async fn compressed(self: &Arc<Self>) -> Option<Bytes> {
        if let Some(gzip) = self.gzip.get() {
            return gzip.clone();
        }
        let file = self.clone();
        let compress = move || file.gzip.get_or_init(|| gzip(&file.bytes)).clone();
        // The task fails only where the runtime is about to end; the file is then sent uncompressed.
        tokio::task::spawn_blocking(compress).await.ok().flatten()
    }
}

fn gzip(bytes: &[u8]) -> Option<Bytes> {
    if bytes.len() < MIN_BYTES {
        return None;
    }
    // `compress_bound` has room for the 6 bytes of a zlib header and trailer; those of gzip have 18.
    let mut buffer = vec![0; compress_bound(bytes.len()) + 12];
    let config = DeflateConfig {
        window_bits: GZIP,
        ..DeflateConfig::default()
    };
    let (compressed, code) = compress_slice(&mut buffer, bytes, config);
    let length = compressed.len();
    let is_smaller = code == ReturnCode::Ok && length < bytes.len();
    is_smaller.then(|| Bytes::copy_from_slice(&buffer[..length]))
}

/// Whether `Accept-Encoding` names gzip, or else `*`, with a quality above 0.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let named: Vec<_> = qualities(headers, ACCEPT_ENCODING).collect();
    let of = |wanted: &str| named.iter().find(|(name, _)| name == wanted);
    let found = of("gzip").or_else(|| of("x-gzip")).or_else(|| of("*"));
    found.is_some_and(|(_, quality)| *quality > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn gzip_is_sent_to_those_who_take_it() {
        for (accepted, expected) in [
            ("gzip, deflate, br, zstd", true),
            ("br;q=1.0, gzip;q=0.8, *;q=0.1", true),
            ("*", true),
            ("GZIP", true),
            ("identity", false),
            ("gzip;q=0, *", false),
            ("br", false),
        ] {
            let value = HeaderValue::from_static(accepted);
            let headers = HeaderMap::from_iter([(ACCEPT_ENCODING, value)]);
            assert_eq!(takes_gzip(&headers), expected, "{accepted}");
        }
        assert!(!takes_gzip(&HeaderMap::new()));
    }
}
