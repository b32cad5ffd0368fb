//! The OpenAPI document: committed, generated, and held to the code.

use crate::application::TestApplication;
use bagtrack_tracker::{Params, Preset};
use serde_json::Value;

const COMMITTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/openapi/openapi.json");

#[test]
fn the_committed_document_is_the_generated_one() {
    let generated = format!("{}\n", bagtrack::http::openapi_document());
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

fn generated() -> Value {
    serde_json::from_str(&bagtrack::http::openapi_document()).unwrap()
}

#[tokio::test]
async fn the_served_document_is_the_generated_one() {
    let app = TestApplication::start().await;
    let response = app.get("/openapi.json").await;
    assert_eq!(response.headers()["content-type"], "application/json");
    let served: Value = response.json().await.unwrap();
    assert_eq!(served, generated());
}

#[test]
fn every_reference_in_the_document_leads_somewhere() {
    let document = generated();
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

async fn served() -> Value {
    let app = TestApplication::start().await;
    app.get("/openapi.json").await.json().await.unwrap()
}

#[tokio::test]
async fn the_schema_has_every_row_of_the_table_of_parameters() {
    let document = served().await;
    let schema = &document["components"]["schemas"]["Parameters"];
    let properties = schema["properties"].as_object().unwrap();
    let robust = serde_json::to_value(Preset::Robust.params()).unwrap();
    for row in Params::TABLE {
        let property = properties.get(row.name);
        let property = property.unwrap_or_else(|| panic!("{} is missing", row.name));
        assert_eq!(property["description"], row.description.trim());
        let (kind, range) = match row.kind {
            "u32" => ("integer", row.range),
            "u64" => ("integer", Some((0.0, u64::MAX as f64))),
            _ => ("number", row.range),
        };
        assert_eq!(property["type"], kind, "{}", row.name);
        let (least, greatest) = range.unzip();
        assert_eq!(property["minimum"].as_f64(), least, "{}", row.name);
        assert_eq!(property["maximum"].as_f64(), greatest, "{}", row.name);
        let default = match row.name {
            "seed" => Value::Null,
            name => robust[name].clone(),
        };
        assert_eq!(property["default"], default, "{}", row.name);
    }
    assert_eq!(properties.len(), Params::TABLE.len());
    assert_eq!(properties["sigma"]["minimum"], 0.0001);
    assert_eq!(properties["particles"]["maximum"], 1000);
    assert_eq!(properties.len(), 16);
}

#[tokio::test]
async fn opening_a_session_tells_the_limits_that_validation_has() {
    let document = served().await;
    let description = &document["paths"]["/sessions"]["post"]["description"];
    let description = description.as_str().unwrap();
    let gray = Preset::Paper.params();
    let beyond = |change: &dyn Fn(&mut Params)| {
        let mut params = gray.clone();
        (params.patch_width, params.patch_height) = (64, 64);
        change(&mut params);
        params.validate().unwrap_err()
    };
    let errors = [
        ("particles", beyond(&|params| params.particles = 1000)),
        (
            "bag_size",
            beyond(&|params| {
                (params.bag_size, params.basis_dim, params.background_samples) = (32, 6, 256)
            }),
        ),
        (
            "background_samples",
            beyond(&|params| (params.particles, params.background_samples) = (250, 150)),
        ),
    ];
    for (name, error) in errors {
        assert_eq!(error.name, name);
        assert!(
            description.contains(error.expected),
            "{name}: {description}"
        );
    }
}
