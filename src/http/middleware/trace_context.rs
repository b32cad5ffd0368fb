//! `traceparent` (W3C Trace Context): the trace of the client goes on here, or a new one begins.
//!
//! The answer has the header with the trace and the span of this request, so that a client finds the request in the
//! log, and among the exported spans (feature `otel`).

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use bagtrack_sessions::random::random_range;

pub const TRACEPARENT: HeaderName = HeaderName::from_static("traceparent");

/// The trace of a request, and its span in that trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TraceContext {
    pub trace: u128,
    /// The span of the client, if it named one.
    pub parent: Option<u64>,
    /// The span of this request.
    pub span: u64,
    /// 1 if the trace is recorded, else 0.
    pub flags: u8,
}

impl TraceContext {
    /// A new span in the trace of these headers; in a new trace where they name none.
    pub fn of(headers: &HeaderMap) -> Self {
        let mut values = headers.get_all(TRACEPARENT).iter();
        let named = match (values.next(), values.next()) {
            (Some(value), None) => value.to_str().ok().and_then(parse),
            _ => None,
        };
        let span = random_range(1..=u64::MAX);
        match named {
            Some(parent) => Self {
                parent: Some(parent.span),
                span,
                ..parent
            },
            None => Self {
                trace: random_range(1..=u128::MAX),
                parent: None,
                span,
                flags: 0,
            },
        }
    }

    /// The id of the trace, as it stands in the header.
    pub fn trace_id(&self) -> String {
        format!("{:032x}", self.trace)
    }

    pub fn header(&self) -> HeaderValue {
        let Self {
            trace, span, flags, ..
        } = self;
        let text = format!("00-{trace:032x}-{span:016x}-{flags:02x}");
        HeaderValue::try_from(text).expect("hexadecimal digits are visible ASCII")
    }
}

/// The trace and the span that the header names. In versions after 00 more may follow the flags, and is ignored.
fn parse(text: &str) -> Option<TraceContext> {
    let mut fields = text.splitn(5, '-');
    let version = hexadecimal(fields.next()?, 2)?;
    let trace = hexadecimal(fields.next()?, 32)?;
    let span = hexadecimal(fields.next()?, 16)?;
    let flags = hexadecimal(fields.next()?, 2)?;
    let ends = fields.next().is_none() || version > 0;
    let valid = version < 0xff && trace > 0 && span > 0 && ends;
    valid.then_some(TraceContext {
        trace,
        parent: None,
        span: span as u64,
        // Version 00 knows only the lowest of the flags.
        flags: (flags & 1) as u8,
    })
}

/// The value of a field that has this number of lower-case hexadecimal digits; `None` for any other field.
fn hexadecimal(field: &str, digits: usize) -> Option<u128> {
    let is_digit = |byte: u8| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    let valid = field.len() == digits && field.bytes().all(is_digit);
    valid
        .then(|| u128::from_str_radix(field, 16).ok())
        .flatten()
}

/// Tells OpenTelemetry of the span of a request. Does nothing where no spans are exported.
#[cfg(feature = "otel")]
pub mod exported {
    use super::TraceContext;
    use axum::extract::{MatchedPath, Request};
    use opentelemetry::Context;
    use opentelemetry::trace::{
        SpanContext, SpanId, TraceContextExt, TraceFlags, TraceId, TraceState,
    };
    use tracing::Span;
    use tracing_opentelemetry::OpenTelemetrySpanExt;

    /// Makes the span a child of the client's. Returns the exported trace and span, or `context` without any.
    pub fn join(span: &Span, request: &Request, context: TraceContext) -> TraceContext {
        if let Some(parent) = context.parent {
            let remote = SpanContext::new(
                TraceId::from(context.trace),
                SpanId::from(parent),
                TraceFlags::new(context.flags),
                true,
                TraceState::default(),
            );
            // `set_parent` fails where nothing is exported.
            let _ = span.set_parent(Context::new().with_remote_span_context(remote));
        }
        span.set_attribute("http.request.method", request.method().to_string());
        if let Some(route) = request.extensions().get::<MatchedPath>() {
            span.set_attribute("http.route", route.as_str().to_owned());
        }
        let exported = span.context();
        let exported = exported.span().span_context().clone();
        match exported.is_valid() {
            false => context,
            true => TraceContext {
                trace: u128::from_be_bytes(exported.trace_id().to_bytes()),
                span: u64::from_be_bytes(exported.span_id().to_bytes()),
                flags: exported.trace_flags().to_u8(),
                ..context
            },
        }
    }

    pub fn answered(span: &Span, status: u16) {
        span.set_attribute("http.response.status_code", i64::from(status));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_valid_headers_name_a_trace() {
        let named = Some(TraceContext {
            trace: 0x4bf9_2f35_77b3_4da6_a3ce_929d_0e0e_4736,
            parent: None,
            span: 0x00f0_67aa_0ba9_02b7,
            flags: 1,
        });
        let good = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
        assert_eq!(parse(good), named);
        assert_eq!(parse(&good.replace("00-4b", "cc-4b")), named);
        assert_eq!(parse(&format!("cc{}-more", &good[2..])), named);
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
