//! Clients with tokens of an identity provider, beside those with API keys.

use crate::application::{TestApplication, expect_detail, expect_problem};
use crate::pictures;
use crate::program::Program;
use crate::stream_client::StreamClient;
use crate::streams::stream::problem_slug;
use bagtrack::http::{Config, Secret};
use bagtrack_testing::issuer::{IssuerKey, key_set};
use reqwest::{Client, StatusCode};
use rustix::process::Signal;
use serde_json::json;
use std::path::Path;
use std::time::{Duration, SystemTime};
use tempfile::TempDir;

const ISSUER: &str = "https://login.example.org";
const AUDIENCE: &str = "bagtrack";
const KEY: &str = "0123456789abcdef";

/// A token for a minute.
fn token(key: &IssuerKey, subject: &str) -> String {
    let expires = SystemTime::now() + Duration::from_secs(60);
    let expires = expires.duration_since(SystemTime::UNIX_EPOCH).unwrap();
    key.sign(&json!({ "iss": ISSUER, "aud": AUDIENCE, "sub": subject, "exp": expires.as_secs() }))
}

/// Writes the key set of an issuer with this key to a file.
fn write_keys(key: &IssuerKey, file: &Path) {
    std::fs::write(file, key_set(&[key])).unwrap();
}

/// A service that accepts tokens signed by this key; requests are made with a token of Ann's. The folder has the key
/// set.
async fn signed_in() -> (TempDir, IssuerKey, TestApplication) {
    let (folder, key) = (tempfile::tempdir().unwrap(), IssuerKey::p256("1"));
    let file = folder.path().join("keys.json");
    write_keys(&key, &file);
    let mut app = with_keys_in(&file).await;
    app.key = Some(token(&key, "ann"));
    (folder, key, app)
}

async fn with_keys_in(file: &Path) -> TestApplication {
    TestApplication::start_with(|config: &mut Config| {
        config.access.api_keys = vec![Secret::from(format!("jwt.ann:{KEY}"))];
        config.access.jwt.jwt_issuer = Some(ISSUER.to_owned());
        config.access.jwt.jwt_audience = vec![AUDIENCE.to_owned()];
        config.access.jwt.jwt_keys = Some(file.display().to_string());
    })
    .await
}

#[tokio::test]
async fn a_session_belongs_to_the_subject_of_the_token_that_opened_it() {
    let (_folder, key, mut app) = signed_in().await;
    let id = app.open().await;
    app.track(&id, 1).await;
    // Another token of Ann's gives access to the same session.
    app.key = Some(token(&key, "ann"));
    app.track(&id, 2).await;
    for other in [token(&key, "ben"), KEY.to_owned()] {
        app.key = Some(other);
        expect_problem(app.get_session(&id).await, "session-not-found").await;
        app.open().await;
    }
    app.key = None;
    expect_problem(app.get_session(&id).await, "unauthorized").await;
    app.key = Some(token(&key, "ann"));
    assert_eq!(app.frames_of(&id).await, 3);
}

#[tokio::test]
async fn a_token_that_has_ended_is_told_so_and_ends_its_stream() {
    let (_folder, _key, mut app) = signed_in().await;
    let id = app.open().await;
    let token = app.token(&id).await;
    let bearer = format!("Bearer {}", app.key.as_deref().unwrap());
    let headers = [("authorization", bearer.as_str())];
    let opened = StreamClient::try_open(app.address, &id, "", &headers).await;
    let mut stream = opened.unwrap();
    stream.send(pictures::png(1)).await;
    assert_eq!(stream.message().await["frame"], 1);

    // The clocks of service and issuer may differ by a minute: in the minute after its expiry, the token is still good,
    // for streams too.
    app.clock.advance(Duration::from_secs(65));
    drop(stream);
    let opened = StreamClient::try_open(app.address, &id, "", &headers).await;
    let mut stream = opened.unwrap();
    stream.send(pictures::png(2)).await;
    assert_eq!(stream.message().await["frame"], 2);
    app.clock.advance(Duration::from_secs(60));
    let refused = app.get_session(&id).await;
    let challenge = "Bearer realm=\"bagtrack\", error=\"invalid_token\"";
    assert_eq!(refused.headers()["www-authenticate"], challenge);
    expect_detail(refused, "unauthorized", &["has expired"]).await;
    stream.send(pictures::png(3)).await;
    assert_eq!(problem_slug(&stream.message().await), "unauthorized");
    assert_eq!(stream.close_code().await, 4401);
    // A session token that Ann gave to a page has a lifetime of its own.
    app.key = Some(token);
    app.track(&id, 3).await;
}

#[tokio::test]
async fn the_program_reads_the_keys_of_the_issuer_again_on_a_hangup() {
    let (folder, old, new) = (
        tempfile::tempdir().unwrap(),
        IssuerKey::p256("old"),
        IssuerKey::p256("new"),
    );
    let file = folder.path().join("keys.json");
    write_keys(&old, &file);
    let keys = file.to_str().unwrap();
    let flags = [
        "--jwt-issuer",
        ISSUER,
        "--jwt-audience",
        AUDIENCE,
        "--jwt-keys",
        keys,
    ];
    let mut service = Program::start(&flags, &[]);
    let status = async |service: &Program, token: &str| {
        let request = Client::new().get(service.url("/metrics"));
        request.bearer_auth(token).send().await.unwrap().status()
    };
    let (of_old, of_new) = (token(&old, "ann"), token(&new, "ann"));
    assert_eq!(status(&service, &of_old).await, StatusCode::OK);
    write_keys(&new, &file);
    assert_eq!(status(&service, &of_new).await, StatusCode::UNAUTHORIZED);
    service.signal(Signal::HUP);
    service.logs("keys of the issuer read again");
    assert_eq!(status(&service, &of_new).await, StatusCode::OK);
    assert_eq!(status(&service, &of_old).await, StatusCode::UNAUTHORIZED);
}
