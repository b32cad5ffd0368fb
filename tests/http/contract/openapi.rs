//! The OpenAPI document: the committed file is the generated one, and agrees with the code.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use bagtrack_tracker::{Params, Preset};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

/// The greatest number that JSON holds exactly in every language.
const MAX_EXACT: u64 = (1 << 53) - 1;

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

#[test]
fn the_schema_has_every_row_of_the_table_of_parameters() {
    let document = generated();
    let schema = &document["components"]["schemas"]["Parameters"];
    let properties = schema["properties"].as_object().unwrap();
    let robust = serde_json::to_value(Preset::Robust.params()).unwrap();
    for row in Params::TABLE {
        let property = properties.get(row.name);
        let property = property.unwrap_or_else(|| panic!("{} is missing", row.name));
        assert_eq!(property["description"], row.description.trim());
        let (kind, range) = match row.kind {
            "u32" => ("integer", row.range),
            "u64" => ("integer", Some((0.0, MAX_EXACT as f64))),
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

#[test]
fn opening_a_session_tells_the_limits_that_validation_has() {
    let document = generated();
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

/// Every object in the document, with the pointer to it.
fn objects(value: &Value, at: String, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(object) => {
            found.push((at.clone(), value.clone()));
            for (name, value) in object {
                objects(value, format!("{at}/{name}"), found);
            }
        }
        Value::Array(array) => {
            for (index, value) in array.iter().enumerate() {
                objects(value, format!("{at}/{index}"), found);
            }
        }
        _ => {}
    }
}

/// Generated clients in typed languages make a 32-bit number of an integer without a format.
#[test]
fn every_integer_has_a_format_and_a_maximum_that_it_can_reach() {
    let mut found = Vec::new();
    objects(&generated(), String::new(), &mut found);
    let is_integer = |schema: &Value| {
        let kind = &schema["type"];
        let kinds = kind.as_array().cloned().unwrap_or(vec![kind.clone()]);
        kinds.contains(&json!("integer"))
    };
    let mut integers = 0;
    for (at, schema) in found.iter().filter(|(_, schema)| is_integer(schema)) {
        integers += 1;
        let max = match schema["format"].as_str() {
            Some("int32") => i32::MAX as u64,
            Some("int64") => MAX_EXACT,
            other => panic!("{at}: {other:?}"),
        };
        match schema["maximum"].as_u64() {
            Some(maximum) => assert!(maximum <= max, "{at}: {schema}"),
            None => {
                let is_setting =
                    at.contains("/parameters/") || at.contains("Json/") || at.contains("Form/");
                assert!(!is_setting && schema["format"] == "int32", "{at}: {schema}");
            }
        }
        let name = at.trim_end_matches("/schema");
        if name.ends_with("/properties/target") {
            assert_eq!(schema["maximum"], 15, "{at}");
        }
        if name.ends_with("/properties/seed") || name.ends_with("/properties/frame") {
            assert_eq!(schema["maximum"], MAX_EXACT, "{at}");
        }
    }
    assert!(integers > 30, "{integers}");
}

#[tokio::test]
async fn the_greatest_seed_is_taken_and_sent_back_and_one_more_refused() {
    let app = TestApplication::start().await;
    let open = async |query: &[(&str, &str)]| {
        let query = [&[("box", BOX), ("verbose", "true")], query].concat();
        app.create(pictures::png(0), &query).await
    };
    let max = MAX_EXACT.to_string();
    let parameters = format!("{{\"seed\": {max}}}");
    for query in [[("seed", &*max)], [("parameters", &*parameters)]] {
        let created = expect(open(&query).await, StatusCode::CREATED).await;
        assert_eq!(created["parameters"]["seed"], MAX_EXACT);
    }
    let more = (MAX_EXACT + 1).to_string();
    expect_problem(open(&[("seed", &more)]).await, "malformed-request").await;
    let parameters = format!("{{\"seed\": {more}}}");
    let refused = open(&[("parameters", &parameters)]).await;
    expect_problem(refused, "invalid-parameter").await;
}

#[test]
fn a_body_has_one_raw_form_beside_the_form_and_json_and_errors_share_an_answer() {
    let document = generated();
    let mut bodies = 0;
    for (path, methods) in document["paths"].as_object().unwrap() {
        for (method, operation) in methods.as_object().unwrap() {
            let name = format!("{method} {path}");
            let statuses = operation["responses"].as_object().unwrap().keys();
            let errors: Vec<&String> = statuses.filter(|status| status.as_str() > "3").collect();
            let shared = ["4XX", "5XX"];
            assert!(
                errors
                    .iter()
                    .all(|status| shared.contains(&status.as_str())),
                "{name}: {errors:?}"
            );
            let Some(content) = operation["requestBody"]["content"].as_object() else {
                continue;
            };
            bodies += 1;
            for media_type in content.keys() {
                let known = [
                    "application/octet-stream",
                    "application/vnd.bagtrack.snapshot",
                    "multipart/form-data",
                    "application/json",
                ];
                assert!(known.contains(&media_type.as_str()), "{name}: {media_type}");
            }
        }
    }
    assert!(bodies >= 5);
}

#[tokio::test]
async fn calls_of_the_service_itself_have_the_rate_limits_that_the_document_says() {
    let app = TestApplication::start().await;
    let document = generated();
    for (method, path, answered) in [
        (Method::POST, "/frames", "4XX"),
        (Method::GET, "/version", "200"),
        (Method::GET, "/healthz", "200"),
        (Method::GET, "/readyz", "200"),
        (Method::GET, "/metrics", "200"),
    ] {
        let name = method.as_str().to_lowercase();
        let said = &document["paths"][path][name]["responses"][answered]["headers"];
        let response = app.request(method, path, &[]).send().await.unwrap();
        for header in ["RateLimit", "RateLimit-Policy"] {
            let is_sent = response.headers().contains_key(header);
            assert_eq!(said[header].is_object(), is_sent, "{path}: {header}");
        }
    }
}

/// Swagger UI offers a file for a parameter with a content type, and nobody can type into that.
#[test]
fn the_parameters_of_the_tracker_can_be_typed_in_a_query() {
    let document = generated();
    let parameters = &document["paths"]["/sessions"]["post"]["parameters"];
    let parameters = parameters.as_array().unwrap().iter();
    let mut named = parameters.filter(|parameter| parameter["name"] == "parameters");
    let schema = &named.next().unwrap()["schema"];
    assert_eq!(schema["type"], "string");
    assert!(
        schema.get("contentMediaType").is_none() && schema["format"] != "binary",
        "{schema}"
    );
}

#[test]
fn calls_stand_in_the_order_in_which_they_are_used() {
    let text = bagtrack::http::openapi_document();
    let text: String = text.split_whitespace().collect();
    // Links contain an `operationId` too, but no summary after it.
    let call = |name: &str| format!("\"operationId\":\"{name}\",\"summary\"");
    let at = |name: &str| text.find(&call(name)).expect(name);
    let order = [
        "createSession",
        "putSession",
        "getSession",
        "deleteSession",
        "postFrames",
        "putTarget",
        "openStream",
        "getSnapshot",
        "getBagPicture",
        "createToken",
        "track",
        "getVersion",
        "getHealth",
    ];
    for pair in order.windows(2) {
        assert!(at(pair[0]) < at(pair[1]), "{pair:?}");
    }
}
