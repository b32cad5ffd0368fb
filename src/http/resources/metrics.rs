//! `GET /metrics`, for Prometheus.

use crate::http::auth::caller::Caller;
use crate::http::extract::texts::refuse_query;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::State;
use axum::http::Uri;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;

/// The text format of Prometheus.
const MEDIA_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Metrics for Prometheus
///
/// Counters, gauges and histograms of requests, frames, sessions and work. With `BAGTRACK_METRICS_KEY` they have a key of
/// their own.
#[utoipa::path(
    get, path = "/metrics", tag = "service", operation_id = "getMetrics",
    responses(
        (
            status = 200, description = "All metrics in the text format of Prometheus", body = String,
            content_type = "text/plain"
        )
    )
)]
pub async fn get(
    State(state): State<AppState>,
    caller: Caller,
    uri: Uri,
) -> Result<impl IntoResponse, Problem> {
    refuse_query(&uri)?;
    caller.require_key()?;
    let (gauges, config, admission) = (
        &state.metrics.gauges,
        &state.config,
        &state.service.admission,
    );
    gauges.sessions.set(state.service.registry.len() as f64);
    gauges.max_sessions.set(config.max_sessions as f64);
    gauges
        .queued
        .set(config.queue.saturating_sub(admission.queue_places()) as f64);
    let workers = config.worker_count();
    gauges.workers.set(workers as f64);
    gauges
        .workers_busy
        .set(admission.busy_workers().min(workers) as f64);
    gauges
        .draining
        .set(if state.is_draining() { 1.0 } else { 0.0 });
    if let Some(store) = &state.service.store {
        state.metrics.store(store.is_ready(), store.failures());
    }
    if let Some(memory) = memory_stats::memory_stats() {
        gauges.resident_memory.set(memory.physical_mem as f64);
    }
    Ok(([(CONTENT_TYPE, MEDIA_TYPE)], state.metrics.render()))
}
