//! Settings as people write them.
#![cfg(unix)]

use crate::application::BOX;
use crate::pictures;
use crate::program::Program;
use reqwest::{Client, StatusCode};
use serde_json::Value;
use std::time::SystemTime;

#[tokio::test]
async fn a_host_name_and_bare_seconds_are_taken() {
    let times = ["--session-idle", "10", "--session-first", "10"];
    let flags = [&["--listen", "localhost:0"], &times[..]].concat();
    let service = Program::start(&flags, &[]);
    assert!(service.address.ip().is_loopback());
    let request = Client::new().post(service.url(&format!("/sessions?box={BOX}")));
    let created = request.body(pictures::png(0)).send().await.unwrap();
    assert_eq!(created.status(), StatusCode::CREATED);
    let created: Value = created.json().await.unwrap();
    let expires = humantime::parse_rfc3339(created["expires_at"].as_str().unwrap()).unwrap();
    let left = expires
        .duration_since(SystemTime::now())
        .map_or(0, |left| left.as_secs());
    assert!(left <= 10, "{left} s");
}
