//! Completes the OpenAPI document: handlers describe their own calls, and this adds what many calls have in common.

use super::key_order::InOrder;
use super::params_schema;
use super::problem_responses::problem_responses;
use crate::requests::MAX_EXACT;
use serde_json::{Map, Value, json};
use utoipa::openapi::OpenApi;

/// The session id of all examples: the example of `putSession` opens the session that the other examples use.
const EXAMPLE_ID: &str = "67e55044-10b1-426f-9247-bb680e5fe0c8";
/// The calls that open a session.
const OPENING: [&str; 2] = ["createSession", "putSession"];
/// The calls that count against no client's quotas.
const WITHOUT_CLIENT: [&str; 4] = ["getVersion", "getHealth", "getReadiness", "getMetrics"];
/// The WebSocket handshake, which no client can make by following a link.
const HANDSHAKE: &str = "openStream";

/// The OpenAPI document as JSON: the calls of `handlers`, for a service below `base_path`.
pub fn document(handlers: &OpenApi, base_path: &str) -> String {
    let document = serde_json::to_value(handlers);
    let mut document = document.expect("the document is plain JSON");
    document["servers"][0]["url"] = base_path.into();
    document["components"]["schemas"]["Parameters"] = json!(params_schema::parameters());
    share_opening(&mut document);
    let links = links(&document);
    bound_integers(&mut document);
    for operation in operations(&mut document) {
        complete_parameters(operation);
        add_problems(operation);
        let is_of_client = !WITHOUT_CLIENT
            .iter()
            .any(|id| operation["operationId"] == *id);
        if is_of_client {
            add_rate_limits(operation);
        }
        if OPENING.iter().any(|id| operation["operationId"] == *id) {
            operation["responses"]["201"]["links"] = links.clone();
        }
    }
    serde_json::to_string_pretty(&InOrder(&document)).expect("the document is plain JSON")
}

/// Copies the body and the responses of `createSession` to `putSession`, which has the same.
fn share_opening(document: &mut Value) {
    let create = &document["paths"]["/sessions"]["post"];
    let shared = ["requestBody", "responses"].map(|member| (member, create[member].clone()));
    for (member, value) in shared {
        document["paths"]["/sessions/{id}"]["put"][member] = value;
    }
}

/// Bounds 64-bit integers by the greatest number that JSON holds exactly in every language.
fn bound_integers(value: &mut Value) {
    match value {
        Value::Object(object) => {
            if object.get("format").is_some_and(|format| format == "int64") {
                let max = json!(MAX_EXACT);
                object.entry("maximum").or_insert(max);
            }
            object.values_mut().for_each(bound_integers);
        }
        Value::Array(array) => array.iter_mut().for_each(bound_integers),
        _ => {}
    }
}

fn operations(document: &mut Value) -> impl Iterator<Item = &mut Value> {
    let paths = document["paths"].as_object_mut();
    let paths = paths.expect("a document has paths").values_mut();
    paths
        .filter_map(Value::as_object_mut)
        .flat_map(Map::values_mut)
}

/// Gives session ids an example, and allows switches in the query without a value.
fn complete_parameters(operation: &mut Value) {
    let parameters = operation.get_mut("parameters");
    let parameters = parameters.and_then(Value::as_array_mut);
    for parameter in parameters.into_iter().flatten() {
        if parameter["in"] == "path" {
            parameter["example"] = EXAMPLE_ID.into();
        }
        if parameter["in"] == "query" && parameter["schema"]["type"] == "boolean" {
            parameter["allowEmptyValue"] = true.into();
        }
    }
}

/// Adds the problems that the operation may answer to its responses.
fn add_problems(operation: &mut Value) {
    let id = operation["operationId"].as_str().unwrap_or_default();
    let problems = problem_responses(id);
    if let Some(responses) = operation["responses"].as_object_mut() {
        responses.extend(problems);
    }
}

/// Adds the headers with the client's quotas to successful answers, and to `4XX`, which has the refusals for a quota
/// (429).
fn add_rate_limits(operation: &mut Value) {
    let header = |text: &str| json!({"description": text, "schema": {"type": "string"}});
    let responses = operation["responses"].as_object_mut();
    for (status, response) in responses.into_iter().flatten() {
        if status.starts_with('2') || status == "4XX" {
            let text = "The client's quotas (draft-ietf-httpapi-ratelimit-headers).";
            response["headers"]["RateLimit-Policy"] = header(text);
            response["headers"]["RateLimit"] = header("What is left of them.");
        }
    }
}

/// Links from the answer that opens a session to all calls on that session.
fn links(document: &Value) -> Value {
    let paths = document["paths"].as_object().expect("a document has paths");
    let on_session = paths
        .iter()
        .filter(|(path, _)| path.starts_with("/sessions/{id}"));
    let operations = on_session.filter_map(|(_, methods)| methods.as_object());
    let ids = operations
        .flat_map(Map::values)
        .filter_map(|operation| operation["operationId"].as_str());
    let ids = ids.filter(|id| *id != HANDSHAKE && !OPENING.contains(id));
    ids.map(|id| {
        (
            id.to_owned(),
            json!({"operationId": id, "parameters": {"id": "$response.body#/id"}}),
        )
    })
    .collect::<Map<_, _>>()
    .into()
}
