//! The examples of the OpenAPI document, sent unchanged, as "Try it out" of Swagger UI does.

use crate::application::TestApplication;
use base64::prelude::{BASE64_STANDARD, Engine};
use reqwest::{Method, Response};
use serde_json::Value;
use std::collections::BTreeSet;

/// The operation that is a WebSocket handshake, and so left out here.
const HANDSHAKE: &str = "openStream";

/// An operation of the document.
struct Call<'a> {
    method: Method,
    path: &'a str,
    operation: &'a Value,
}

impl<'a> Call<'a> {
    fn all(document: &'a Value) -> Vec<Self> {
        let paths = document["paths"].as_object().unwrap();
        let methods = paths.iter().flat_map(|(path, methods)| {
            let methods = methods.as_object().unwrap();
            methods.iter().map(move |(method, operation)| Self {
                method: method.to_uppercase().parse().unwrap(),
                path,
                operation,
            })
        });
        methods.filter(|call| call.id() != HANDSHAKE).collect()
    }

    fn id(&self) -> &'a str {
        self.operation["operationId"].as_str().unwrap()
    }

    /// The values that Swagger UI fills in for the parameters in this place (`path`, `query` or `header`).
    fn given(&self, place: &str) -> Vec<(&'a str, String)> {
        let parameters = self.operation["parameters"].as_array();
        let here = parameters
            .into_iter()
            .flatten()
            .filter(|parameter| parameter["in"] == place);
        let given = here.filter_map(|parameter| {
            let schema = &parameter["schema"];
            let values = [
                &parameter["example"],
                &schema["example"],
                &schema["examples"][0],
                &schema["default"],
            ];
            let value = values.into_iter().find(|value| !value.is_null())?;
            let text = value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned);
            Some((parameter["name"].as_str().unwrap(), text))
        });
        given.collect()
    }

    /// The bodies to send: none; or each example, and its frame as a raw body of each media type of a file.
    fn bodies(&self) -> Vec<(&'a str, Vec<u8>)> {
        let Some(content) = self.operation["requestBody"]["content"].as_object() else {
            return vec![("", Vec::new())];
        };
        // Its body is a video, which needs ffmpeg: the tests of `videos` send some.
        if self.id() == "getVideoFrames" {
            return Vec::new();
        }
        let example = &content["application/json"]["example"];
        let frame = [&example["frame"], &example["frames"][0], &example["image"]]
            .into_iter()
            .find_map(Value::as_str);
        let frame = BASE64_STANDARD.decode(frame.unwrap()).unwrap();
        let bodies = content.iter().filter_map(|(media_type, body)| {
            let is_file =
                media_type.starts_with("image/") || media_type == "application/octet-stream";
            let bytes = match &body["example"] {
                Value::Null => is_file.then(|| frame.clone())?,
                example => example.to_string().into_bytes(),
            };
            Some((media_type.as_str(), bytes))
        });
        bodies.collect()
    }

    async fn send(&self, app: &TestApplication, (media_type, bytes): (&str, Vec<u8>)) -> Response {
        let path = self
            .given("path")
            .iter()
            .fold(self.path.to_owned(), |path, (name, value)| {
                path.replace(&format!("{{{name}}}"), value)
            });
        let query = self.given("query");
        let query: Vec<_> = query
            .iter()
            .map(|(name, value)| (*name, value.as_str()))
            .collect();
        let mut request = app.request(self.method.clone(), &path, &query);
        if !media_type.is_empty() {
            request = request.header("content-type", media_type).body(bytes);
        }
        request.send().await.unwrap()
    }
}

#[tokio::test]
async fn every_example_of_the_document_works_as_it_stands() {
    let document: Value = serde_json::from_str(&bagtrack::http::openapi_document()).unwrap();
    let calls = Call::all(&document);
    let open = calls.iter().find(|call| call.id() == "putSession").unwrap();
    let mut sent = BTreeSet::new();
    for call in &calls {
        for body in call.bodies() {
            let app = TestApplication::start().await;
            if call.path.contains("{id}") && call.id() != open.id() {
                let opening = open
                    .bodies()
                    .into_iter()
                    .find(|(kind, _)| *kind == "application/json");
                assert_eq!(open.send(&app, opening.unwrap()).await.status(), 201);
            }
            let name = format!("{} {}", call.id(), body.0);
            let response = call.send(&app, body).await;
            let status = response.status();
            let answer = String::from_utf8_lossy(&response.bytes().await.unwrap()).into_owned();
            assert!(status.is_success(), "{name}: {status} {answer}");
            sent.insert(name);
        }
    }
    let with_body = calls
        .iter()
        .filter(|call| !call.operation["requestBody"].is_null())
        .filter(|call| call.id() != "getVideoFrames");
    for call in with_body {
        for form in ["application/octet-stream", "application/json"] {
            assert!(sent.contains(&format!("{} {form}", call.id())), "{sent:?}");
        }
    }
}

#[tokio::test]
async fn the_raw_file_is_the_first_form_of_a_frame_wherever_it_is_enough() {
    let text = bagtrack::http::openapi_document();
    let operations = text.split("\"operationId\"").skip(1);
    let bodies = operations.filter_map(|operation| {
        let body = operation.split_once("\"requestBody\"")?.1;
        body.split("\"responses\"").next()
    });
    let bodies: Vec<&str> = bodies.collect();
    let takes_forms = |body: &&str| body.contains("multipart/form-data");
    assert!(
        bodies
            .iter()
            .copied()
            .filter(|body| takes_forms(body))
            .count()
            >= 5
    );
    for body in bodies.into_iter().filter(takes_forms) {
        let at = |name: &str| body.find(&format!("\"{name}\": {{"));
        assert!(at("application/octet-stream").unwrap() < at("multipart/form-data").unwrap());
        assert!(at("multipart/form-data") < at("application/json"));
    }
}
