//! `GET /version`.

use crate::http::extract::query::NoQuery;
use crate::http::respond::json::Json;
use serde::Serialize;

/// The program that answers.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub struct Version {
    /// Always `bagtrack`.
    #[schema(example = "bagtrack")]
    name: &'static str,
    /// Its version. Snapshots of another one are refused.
    #[schema(example = "0.1.0")]
    version: &'static str,
}

/// See which version answers
///
/// Needs no key.
#[utoipa::path(
    get, path = "/version", tag = "service", operation_id = "getVersion", security(()),
    responses((status = 200, description = "The version", body = Version))
)]
pub async fn get(_: NoQuery) -> Json<Version> {
    Json(Version {
        name: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
    })
}
