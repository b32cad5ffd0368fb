//! `traceparent` (W3C Trace Context): the trace of the client goes on here, or a new one begins.
//!
//! The answer has the header with the trace and the span of this request, so that a client finds it in the log. Nothing
//! is exported.

use axum::extract::Request;
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;

/// The header.
pub const TRACEPARENT: HeaderName = HeaderName::from_static("traceparent");

/// The trace of a request, and its span in that trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TraceContext {
    trace: u128,
    span: u64,
    flags: u8,
}

impl TraceContext {
    /// A new span in the trace of these headers; in a new trace where they name none.
    fn of(headers: &HeaderMap) -> Self {
        let mut values = headers.get_all(TRACEPARENT).iter();
        let parent = match (values.next(), values.next()) {
            (Some(value), None) => value.to_str().ok().and_then(parse),
            _ => None,
        };
        let (trace, flags) = parent.unwrap_or_else(|| (rand::random_range(1..=u128::MAX), 0));
        Self {
            trace,
            span: rand::random_range(1..=u64::MAX),
            flags,
        }
    }

    /// The id of the trace, as it stands in the header.
    pub fn trace_id(&self) -> String {
        format!("{:032x}", self.trace)
    }

    fn header(&self) -> HeaderValue {
        let text = format!(
            "00-{:032x}-{:016x}-{:02x}",
            self.trace, self.span, self.flags
        );
        HeaderValue::try_from(text).expect("hexadecimal digits are visible ASCII")
    }
}

/// The middleware.
pub async fn trace_request(mut request: Request, next: Next) -> Response {
    let context = TraceContext::of(request.headers());
    request.extensions_mut().insert(context);
    let mut response = next.run(request).await;
    response.headers_mut().insert(TRACEPARENT, context.header());
    response
}

/// The id and the flags of a trace. Of a version to come, what follows the flags is left out.
fn parse(text: &str) -> Option<(u128, u8)> {
    let mut fields = text.splitn(5, '-');
    let version = hexadecimal(fields.next()?, 2)?;
    let trace = hexadecimal(fields.next()?, 32)?;
    let parent = hexadecimal(fields.next()?, 16)?;
    let flags = hexadecimal(fields.next()?, 2)?;
    let ends = fields.next().is_none() || version > 0;
    let valid = version < 0xff && trace > 0 && parent > 0 && ends;
    // Of the flags, version 00 knows only the lowest.
    valid.then_some((trace, (flags & 1) as u8))
}

/// A field of lower-case hexadecimal digits.
fn hexadecimal(field: &str, digits: usize) -> Option<u128> {
    let is_digit = |byte: u8| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    let valid = field.len() == digits && field.bytes().all(is_digit);
    valid
        .then(|| u128::from_str_radix(field, 16).ok())
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_valid_headers_name_a_trace() {
        let trace = 0x4bf9_2f35_77b3_4da6_a3ce_929d_0e0e_4736;
        let good = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
        assert_eq!(parse(good), Some((trace, 1)));
        assert_eq!(parse(&good.replace("00-4b", "cc-4b")), Some((trace, 1)));
        assert_eq!(parse(&format!("cc{}-more", &good[2..])), Some((trace, 1)));
        for bad in [
            "",
            "00",
            "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
            "00-+bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        ] {
            assert_eq!(parse(bad), None, "{bad}");
        }
    }
}
