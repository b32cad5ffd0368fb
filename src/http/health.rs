//! `/healthz` and `/readyz`: whether the process runs, and whether it is ready for requests.

use super::openapi::problem_responses::{self, operation_problems};
use super::problems::kind::Kind;
use super::problems::problem::Problem;
use super::state::AppState;
use axum::Json;
use axum::extract::State;
use serde::Serialize;

/// The service runs.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub struct Health {
    /// Always `ok`.
    #[schema(example = "ok")]
    status: &'static str,
}

const OK: Json<Health> = Json(Health { status: "ok" });

operation_problems!(LiveProblems, problem_responses::ALWAYS);

operation_problems!(ReadyProblems, problem_responses::ALWAYS, &[Kind::NotReady]);

/// Whether the process runs
#[utoipa::path(
    get, path = "/healthz", tag = "service", operation_id = "getHealth", security(()),
    responses((status = 200, description = "It runs", body = Health), LiveProblems)
)]
pub async fn live() -> Json<Health> {
    OK
}

/// Whether the service wants requests
///
/// A load balancer should send none while this answers 503: the service was asked to end, or its queue is full. A queue
/// that was full counts as full until half of it is free.
#[utoipa::path(
    get, path = "/readyz", tag = "service", operation_id = "getReadiness", security(()),
    responses((status = 200, description = "It does", body = Health), ReadyProblems)
)]
pub async fn ready(State(state): State<AppState>) -> Result<Json<Health>, Problem> {
    if state.is_draining() {
        return Err(Problem::not_ready());
    }
    let (free, all) = (state.admission.queue_places(), state.config.queue);
    match state.saturation.update(free, all) {
        true => Err(Problem::saturated()),
        false => Ok(OK),
    }
}
