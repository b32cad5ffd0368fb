//! Writes JSON with the members of objects in a chosen order: some readers of OpenAPI documents use only the first of
//! several.

use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;

/// The members that come before all others, in this order. Paths are in the order of use. Client generators and Swagger
/// UI use the first media type of a body or an answer: so a raw file comes before a form, a form before base64 in JSON,
/// and JSON before a picture.
const FIRST: &[&str] = &[
    "openapi",
    "info",
    "servers",
    "tags",
    "security",
    "paths",
    "/sessions",
    "/sessions/{id}",
    "/sessions/{id}/frames",
    "/sessions/{id}/target",
    "/sessions/{id}/stream",
    "/sessions/{id}/snapshot",
    "/sessions/{id}/bag.png",
    "/sessions/{id}/token",
    "/track",
    "/version",
    "/healthz",
    "/readyz",
    "/metrics",
    "post",
    "put",
    "get",
    "delete",
    "application/octet-stream",
    "application/vnd.bagtrack.snapshot",
    "multipart/form-data",
    "application/json",
    "image/png",
    "operationId",
    "summary",
    "description",
    "$ref",
    "type",
    "name",
    "in",
];

/// A JSON value that is serialised with its members in the order of `FIRST`.
pub struct InOrder<'a>(pub &'a Value);

impl Serialize for InOrder<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Value::Object(object) => {
                let mut members: Vec<_> = object.iter().collect();
                // The sort is stable: all other members keep their order.
                members.sort_by_key(|(name, _)| {
                    FIRST
                        .iter()
                        .position(|first| first == name)
                        .unwrap_or(FIRST.len())
                });
                let mut map = serializer.serialize_map(Some(members.len()))?;
                for (name, value) in members {
                    map.serialize_entry(name, &InOrder(value))?;
                }
                map.end()
            }
            Value::Array(array) => serializer.collect_seq(array.iter().map(InOrder)),
            other => other.serialize(serializer),
        }
    }
}
