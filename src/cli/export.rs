//! Exports the spans of requests with OpenTelemetry, in its own protocol (OTLP) over HTTP.
//!
//! The usual variables say where to and how: `OTEL_EXPORTER_OTLP_ENDPOINT` (without it nothing is exported),
//! `OTEL_SERVICE_NAME`, `OTEL_TRACES_SAMPLER` and so on. A thread of its own sends the spans in batches. Spans are
//! dropped while the collector does not answer; no request waits for it.

use opentelemetry::trace::TracerProvider;
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SdkTracer, SdkTracerProvider};
use std::time::Duration;
use tracing::Subscriber;
use tracing_opentelemetry::OpenTelemetryLayer;
use tracing_subscriber::registry::LookupSpan;

const ENDPOINTS: [&str; 2] = [
    "OTEL_EXPORTER_OTLP_ENDPOINT",
    "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT",
];
const NAME: &str = "bagtrack";
/// Time for the last spans to be sent.
const LAST_SPANS: Duration = Duration::from_secs(2);

/// The export. The last spans are sent when it is dropped.
#[derive(Debug)]
pub struct Export(SdkTracerProvider);

impl Export {
    /// Begins to export; `None` if no variable says where to.
    ///
    /// # Errors
    /// The variables cannot be used.
    pub fn start() -> Result<Option<Self>, String> {
        if ENDPOINTS
            .iter()
            .all(|name| std::env::var_os(name).is_none())
        {
            return Ok(None);
        }
        let exporter = opentelemetry_otlp::SpanExporter::builder().with_http();
        let exporter = exporter
            .build()
            .map_err(|error| format!("spans cannot be exported: {error}"))?;
        let mut resource = Resource::builder();
        if std::env::var_os("OTEL_SERVICE_NAME").is_none() {
            resource = resource.with_service_name(NAME);
        }
        let provider = SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_resource(resource.build());
        Ok(Some(Self(provider.build())))
    }

    /// The layer that hands spans to the export.
    pub fn layer<S>(&self) -> OpenTelemetryLayer<S, SdkTracer>
    where
        S: Subscriber + for<'span> LookupSpan<'span>,
    {
        tracing_opentelemetry::layer().with_tracer(self.0.tracer(NAME))
    }
}

impl Drop for Export {
    fn drop(&mut self) {
        if let Err(error) = self.0.shutdown_with_timeout(LAST_SPANS) {
            tracing::warn!(%error, "the last spans were not exported");
        }
    }
}
