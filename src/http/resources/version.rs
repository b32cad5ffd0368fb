//! `GET /version`.

use crate::http::extract::query::NoQuery;
use crate::http::respond::body::Json;
use bagtrack_api::Version;

/// See which version answers
///
/// Needs no key.
#[utoipa::path(
    get, path = "/version", tag = "service", operation_id = "getVersion", security(()),
    responses((status = 200, description = "The version", body = Version))
)]
pub async fn get(_: NoQuery) -> Json<Version> {
    Json(Version {
        name: env!("CARGO_PKG_NAME").to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    })
}
