//! What OpenTelemetry is told of the span of a request. Where nothing is exported this does nothing.

use super::trace_context::TraceContext;
use axum::extract::{MatchedPath, Request};
use opentelemetry::Context;
use opentelemetry::trace::{SpanContext, SpanId, TraceContextExt, TraceFlags, TraceId, TraceState};
use tracing::Span;
use tracing_opentelemetry::OpenTelemetrySpanExt;

/// Makes the span a child of the client's, and gives the trace and the span that are exported.
pub fn join(span: &Span, request: &Request, context: TraceContext) -> TraceContext {
    if let Some(parent) = context.parent {
        let remote = SpanContext::new(
            TraceId::from(context.trace),
            SpanId::from(parent),
            TraceFlags::new(context.flags),
            true,
            TraceState::default(),
        );
        // It fails where nothing is exported.
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
