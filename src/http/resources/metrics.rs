//! `GET /metrics`, for Prometheus.

use crate::http::extract::caller::Caller;
use crate::http::extract::query::NoQuery;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::extract::State;
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
    _: NoQuery,
    caller: Caller,
) -> Result<impl IntoResponse, Problem> {
    caller.require_key()?;
    state.measure();
    Ok(([(CONTENT_TYPE, MEDIA_TYPE)], state.metrics.render()))
}
