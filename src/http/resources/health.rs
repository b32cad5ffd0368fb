//! `/healthz` and `/readyz`: whether the process runs, and whether it is ready for requests.

use crate::http::problems::kind::Kind;
use crate::http::problems::problem::Problem;
use crate::http::respond::json::Json;
use crate::http::state::AppState;
use axum::extract::State;
use bagtrack_sessions::StoreUnavailable;
use serde::Serialize;

/// The service runs.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub struct Health {
    /// `ok`; or `store-full` from `/readyz` while the store of sessions takes frames and no new sessions.
    #[schema(example = "ok")]
    status: &'static str,
}

const OK: Json<Health> = Json(Health { status: "ok" });
const STORE_FULL: Json<Health> = Json(Health {
    status: "store-full",
});

/// Whether the process runs
///
/// Answers as long as the process can answer at all. A supervisor may end it when this does not come.
#[utoipa::path(
    get, path = "/healthz", tag = "service", operation_id = "getHealth", security(()),
    responses((status = 200, description = "It runs", body = Health))
)]
pub async fn live() -> Json<Health> {
    OK
}

/// Whether the service wants requests
///
/// A load balancer should send none while this answers 503: the service was asked to end, its queue or its memory for
/// bodies is full, or the store of its sessions gives no answer or takes no writes. What was full counts as full until
/// half of it is free.
///
/// A store that is nearly full is no reason: all replicas share it, and it takes the frames of the sessions that it has.
/// The answer is 200 then, with the status `store-full`.
#[utoipa::path(
    get, path = "/readyz", tag = "service", operation_id = "getReadiness", security(()),
    responses((status = 200, description = "It does", body = Health))
)]
pub async fn ready(State(state): State<AppState>) -> Result<Json<Health>, Problem> {
    if state.is_draining() {
        return Err(Problem::not_ready());
    }
    if let Some(store) = &state.service.store
        && !store.is_ready()
    {
        return Err(Problem::from(StoreUnavailable::default()).with_kind(Kind::NotReady));
    }
    let (places, bytes) = (state.service.admission.queue_places(), state.uploads.left());
    let queue = state.queue_saturation.update(places, state.config.queue);
    let uploads = state
        .upload_saturation
        .update(bytes, state.config.max_upload_bytes);
    match (queue, uploads) {
        (true, _) => Err(Problem::saturated("The queue is full.")),
        (_, true) => Err(Problem::saturated("The memory for bodies is used up.")),
        (false, false)
            if state
                .service
                .store
                .as_ref()
                .is_some_and(|store| store.is_full()) =>
        {
            Ok(STORE_FULL)
        }
        (false, false) => Ok(OK),
    }
}
