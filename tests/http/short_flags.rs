//! Settings as people write them.
#![cfg(unix)]

use crate::application::BOX;
use crate::pictures;
use crate::process::Service;
use reqwest::StatusCode;
use serde_json::Value;
use std::time::SystemTime;

#[tokio::test]
async fn a_host_name_and_bare_seconds_are_taken() {
    let flags = ["--session-idle", "10", "--session-first", "10"];
    let service = Service::start_at("localhost:0", &flags, &[]).await;
    assert!(service.address.ip().is_loopback());
    let request = service
        .client
        .post(service.url(&format!("/sessions?box={BOX}")));
    let created = request.body(pictures::png(0)).send().await.unwrap();
    assert_eq!(created.status(), StatusCode::CREATED);
    let created: Value = created.json().await.unwrap();
    let expires = humantime::parse_rfc3339(created["expires_at"].as_str().unwrap()).unwrap();
    let left = expires
        .duration_since(SystemTime::now())
        .map_or(0, |left| left.as_secs());
    assert!(left <= 10, "{left} s");
}
