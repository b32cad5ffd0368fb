//! The OpenAPI document: committed, generated, and held to the code.

use crate::application::TestApplication;
use serde_json::Value;

const COMMITTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/openapi/openapi.json");

#[test]
fn the_committed_document_is_the_generated_one() {
    let mut generated = bagtrack::http::openapi_document().to_pretty_json().unwrap();
    generated.push('\n');
    if std::env::var_os("BAGTRACK_UPDATE").is_some() {
        std::fs::write(COMMITTED, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(COMMITTED).unwrap_or_default();
    assert!(
        committed == generated,
        "openapi/openapi.json is not what the handlers say. Write it anew with \
         `BAGTRACK_UPDATE=1 cargo test --test http openapi` and commit it."
    );
}

#[tokio::test]
async fn the_served_document_is_the_generated_one() {
    let app = TestApplication::start().await;
    let response = app.get("/openapi.json").await;
    assert_eq!(response.headers()["content-type"], "application/json");
    let served: Value = response.json().await.unwrap();
    let generated = serde_json::to_value(bagtrack::http::openapi_document()).unwrap();
    assert_eq!(served, generated);
}

#[test]
fn every_reference_in_the_document_leads_somewhere() {
    let document = serde_json::to_value(bagtrack::http::openapi_document()).unwrap();
    let mut references = 0;
    let mut open = vec![&document];
    while let Some(value) = open.pop() {
        match value {
            Value::Object(object) => {
                if let Some(Value::String(reference)) = object.get("$ref") {
                    let pointer = reference.strip_prefix('#').unwrap();
                    assert!(document.pointer(pointer).is_some(), "{reference}");
                    references += 1;
                }
                open.extend(object.values());
            }
            Value::Array(array) => open.extend(array),
            _ => {}
        }
    }
    assert!(references > 10);
}
