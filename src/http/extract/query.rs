//! Settings of calls that take no body.

use crate::http::problems::problem::Problem;
use axum::extract::{FromRequestParts, Query};
use axum::http::request::Parts;
use serde::de::DeserializeOwned;

/// The settings in the query.
#[derive(Debug)]
pub struct QuerySettings<T>(pub T);

impl<S: Sync, T: DeserializeOwned> FromRequestParts<S> for QuerySettings<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        match Query::try_from_uri(&parts.uri) {
            Ok(Query(settings)) => Ok(Self(settings)),
            Err(error) => {
                let detail = format!("The query cannot be read: {error}.");
                Err(Problem::malformed(detail))
            }
        }
    }
}

/// No settings: refuses any query.
#[derive(Debug)]
pub struct NoQuery;

impl<S: Sync> FromRequestParts<S> for NoQuery {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        match parts.uri.query() {
            None | Some("") => Ok(Self),
            Some(_) => Err(Problem::malformed("This call takes no query parameters.")),
        }
    }
}
