//! `/healthz` and `/readyz`: whether the process runs, and whether it is ready for requests.

use crate::http::problems::problem::Problem;
use crate::http::respond::body::Json;
use crate::http::state::AppState;
use axum::extract::State;
use bagtrack_api::Health;
use bagtrack_api::ProblemKind as Kind;

fn health(status: &str) -> Json<Health> {
    let status = status.to_owned();
    Json(Health { status })
}

/// Whether the process runs
///
/// Answers as long as the process can answer at all. A supervisor may end it when this does not come.
#[utoipa::path(
    get, path = "/healthz", tag = "service", operation_id = "getHealth", security(()),
    responses((status = 200, description = "It runs", body = Health))
)]
pub async fn live() -> Json<Health> {
    health("ok")
}

/// Whether the service wants requests
///
/// A load balancer should send none while this answers 503: the service was asked to end, its queue or its memory for
/// bodies is full, or the store of its sessions gives no answer or takes no writes. What was full counts as full until
/// half of it is free.
///
/// A store that is nearly full is no reason: all replicas share it, and it takes the frames of the sessions that it
/// has. The answer is 200 then, with the status `store-full`.
#[utoipa::path(
    get, path = "/readyz", tag = "service", operation_id = "getReadiness", security(()),
    responses((status = 200, description = "It does", body = Health))
)]
pub async fn ready(State(state): State<AppState>) -> Result<Json<Health>, Problem> {
    if state.is_draining() {
        return Err(Problem::not_ready());
    }
    let store = state.service.store.as_ref();
    if store.is_some_and(|store| !store.is_ready()) {
        let detail =
            "The store of the sessions gives no answer, or takes no writes. The log says why.";
        return Err(Problem::new(Kind::NotReady, detail));
    }
    check_room(&state)?;
    match store.is_some_and(|store| store.is_full()) {
        true => Ok(health("store-full")),
        false => Ok(health("ok")),
    }
}

/// Whether there is room for requests: places in the queue, and memory for bodies.
fn check_room(state: &AppState) -> Result<(), Problem> {
    let (places, bytes) = (state.service.admission.queue_places(), state.uploads.left());
    let queue = state.queue_saturation.update(places, state.config.queue);
    let uploads = state
        .upload_saturation
        .update(bytes, state.config.max_upload_bytes);
    match (queue, uploads) {
        (true, _) => Err(Problem::saturated("The queue is full.")),
        (_, true) => Err(Problem::saturated("The memory for bodies is used up.")),
        (false, false) => Ok(()),
    }
}
