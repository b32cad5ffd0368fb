//! `GET /metrics`, for Prometheus.

use crate::http::extract::caller::Caller;
use crate::http::extract::query::NoQuery;
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use bagtrack_sessions::clock;
use std::sync::Arc;

const MEDIA_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Metrics for Prometheus
///
/// Counters, gauges and histograms of requests, frames, sessions and work. With `BAGTRACK_METRICS_KEY` they have a key
/// of their own.
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
    let text = rendered(&state).await?;
    Ok(([(CONTENT_TYPE, MEDIA_TYPE)], text))
}

/// The text of the metrics at this moment. Rendering takes a millisecond and more, so a thread for blocking work does
/// it: one text at a time, for all requests that came before it was begun.
async fn rendered(state: &AppState) -> Result<Bytes, Problem> {
    let asked = clock::now();
    let mut rendered = state.rendered_metrics.lock().await;
    if let Some((began, text)) = &*rendered
        && *began > asked
    {
        return Ok(text.clone());
    }
    let (began, state) = (clock::now(), state.clone());
    let render = move || {
        state.measure();
        Bytes::from(state.metrics.render())
    };
    let text = tokio::task::spawn_blocking(render).await;
    let text = text.map_err(|error| Problem::internal(Arc::new(error)))?;
    *rendered = Some((began, text.clone()));
    Ok(text)
}
