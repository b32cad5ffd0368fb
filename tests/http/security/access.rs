//! API keys and session tokens: who may use what.

use crate::application::{BOX, TestApplication, expect, expect_detail, expect_problem};
use crate::pictures;
use bagtrack::http::{Application, Config, Secret};
use bagtrack_sessions::Clock;
use reqwest::{Method, StatusCode};
use std::time::{Duration, SystemTime};

const ANN: &str = "0123456789abcdef";
const BEN: &str = "fedcba9876543210";

/// A service with the keys of two clients; requests are made with that of the first.
async fn two_clients() -> TestApplication {
    TestApplication::start_with(|config| {
        config.access.api_keys = vec![
            Secret::from("ann:0123456789abcdef"),
            Secret::from("ben:fedcba9876543210"),
        ];
    })
    .await
}

#[tokio::test]
async fn nothing_is_done_without_a_valid_key() {
    let mut app = two_clients().await;
    let id = app.open().await;
    let paths = |id: &str| {
        [
            (Method::POST, "/sessions".to_owned()),
            (Method::GET, format!("/sessions/{id}")),
            (Method::DELETE, format!("/sessions/{id}")),
            (Method::POST, format!("/sessions/{id}/frames")),
            (Method::PUT, format!("/sessions/{id}/target")),
            (Method::GET, format!("/sessions/{id}/snapshot")),
            (Method::POST, format!("/sessions/{id}/token")),
            (Method::GET, "/metrics".to_owned()),
        ]
    };
    for key in [
        None,
        Some("0123456789abcdeF"),
        Some("ann:0123456789abcdef"),
        Some("ann"),
        Some(""),
    ] {
        app.key = key.map(str::to_owned);
        for (method, path) in paths(&id) {
            let response = app.request(method, &path, &[]).send().await.unwrap();
            assert_eq!(
                response.headers()["www-authenticate"],
                "Bearer realm=\"bagtrack\""
            );
            expect_problem(response, "unauthorized").await;
        }
    }
    // Two keys in one request do not count as a key.
    app.key = Some(ANN.to_owned());
    let request = app.request(Method::GET, &format!("/sessions/{id}"), &[]);
    expect_problem(
        request.bearer_auth(BEN).send().await.unwrap(),
        "unauthorized",
    )
    .await;
    // Probes and the pages for people need no key.
    app.key = None;
    for path in ["/healthz", "/readyz", "/", "/docs/", "/openapi.json"] {
        assert_eq!(app.get(path).await.status(), StatusCode::OK, "{path}");
    }
    app.key = Some(ANN.to_owned());
    assert_eq!(app.frames_of(&id).await, 1);
}

/// Each mistake has a text of its own, with its own cure.
#[tokio::test]
async fn what_is_wrong_with_a_key_is_told() {
    let mut app = two_clients().await;
    app.key = None;
    for (header, told) in [
        (None, "Send an API key"),
        (Some(ANN), "must be `Authorization: Bearer"),
        (Some("Basic YW5uOg=="), "must be `Authorization: Bearer"),
        (Some("Bearer 0123456789abcdeF"), "is not known"),
        (Some("Bearer ann:0123456789abcdef"), "after the colon"),
        (
            Some("Bearer bagtrack-session.x"),
            "POST /sessions/{id}/token",
        ),
    ] {
        let mut request = app.request(Method::GET, "/metrics", &[]);
        if let Some(header) = header {
            request = request.header("authorization", header);
        }
        let refused = request.send().await.unwrap();
        expect_detail(refused, "unauthorized", &[told]).await;
    }
}

#[tokio::test]
async fn a_session_is_not_there_for_other_clients() {
    let mut app = two_clients().await;
    let id = app.open().await;
    app.key = Some(BEN.to_owned());
    expect_problem(app.get_session(&id).await, "session-not-found").await;
    expect_problem(app.snapshot_of(&id).await, "session-not-found").await;
    expect_problem(app.delete_session(&id).await, "session-not-found").await;
    let frame = app.post_frame(&id, pictures::png(1)).await;
    expect_problem(frame, "session-not-found").await;
    let target = app.put_target(&id, pictures::png(1), &[("box", BOX)]).await;
    expect_problem(target, "session-not-found").await;
    let token = app.request(Method::POST, &format!("/sessions/{id}/token"), &[]);
    expect_problem(token.send().await.unwrap(), "session-not-found").await;
    app.key = Some(ANN.to_owned());
    assert_eq!(app.frames_of(&id).await, 1);
    // Other clients are not told that the session has expired, either.
    app.clock.advance(Duration::from_secs(600));
    expect_problem(app.get_session(&id).await, "session-expired").await;
    app.key = Some(BEN.to_owned());
    expect_problem(app.get_session(&id).await, "session-not-found").await;
}

#[tokio::test]
async fn a_token_is_good_for_its_session_alone() {
    let mut app = two_clients().await;
    let (id, other) = (app.open().await, app.open().await);
    app.key = Some(app.token(&id).await);
    app.track(&id, 1).await;
    assert_eq!(app.frames_of(&id).await, 2);
    expect_problem(app.get_session(&other).await, "session-not-found").await;
    let opened = app.create(pictures::png(0), &[("box", BOX)]).await;
    expect_problem(opened, "forbidden").await;
    let again = app.request(Method::POST, &format!("/sessions/{id}/token"), &[]);
    expect_problem(again.send().await.unwrap(), "forbidden").await;
    expect_problem(app.get("/metrics").await, "forbidden").await;
    expect(app.delete_session(&id).await, StatusCode::NO_CONTENT).await;
    expect_problem(app.get_session(&id).await, "session-not-found").await;
}

#[tokio::test]
async fn a_token_is_not_good_for_a_later_session_of_the_same_id() {
    let mut app = two_clients().await;
    let id = uuid::Uuid::new_v4().to_string();
    let path = format!("/sessions/{id}");
    let open = async |app: &TestApplication| {
        let request = app.request(Method::PUT, &path, &[("box", BOX)]);
        let opened = request.body(pictures::png(0)).send().await.unwrap();
        expect(opened, StatusCode::CREATED).await;
    };
    open(&app).await;
    let token = app.token(&id).await;
    expect(app.delete_session(&id).await, StatusCode::NO_CONTENT).await;
    open(&app).await;
    app.key = Some(token);
    expect_problem(app.get_session(&id).await, "session-not-found").await;
    let frame = app.post_frame(&id, pictures::png(1)).await;
    expect_problem(frame, "session-not-found").await;
    expect_problem(app.snapshot_of(&id).await, "session-not-found").await;
    expect_problem(app.delete_session(&id).await, "session-not-found").await;
    app.key = Some(ANN.to_owned());
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn before_1970_answers_tell_the_first_moment_that_dates_have() {
    let config = Config {
        listen: "127.0.0.1:0".parse().unwrap(),
        ..Config::default()
    };
    let clock = Clock::with_wall(|| SystemTime::UNIX_EPOCH - Duration::from_secs(864_000));
    let application = Application::bind_with_clock(config, clock);
    let application = application.await.unwrap();
    let url = format!("http://{}/sessions", application.local_addr().unwrap());
    tokio::spawn(application.serve(std::future::pending::<()>()));
    let client = reqwest::Client::new();
    let create = client.post(format!("{url}?box={BOX}"));
    let created = create.body(pictures::png(0)).send().await.unwrap();
    let created = expect(created, StatusCode::CREATED).await;
    let session = format!("{url}/{}", created["id"].as_str().unwrap());
    // Such dates must not panic in formatting, and so give 500.
    let view = expect(client.get(&session).send().await.unwrap(), StatusCode::OK).await;
    assert!(
        view["expires_at"].as_str().unwrap().starts_with("1970-"),
        "{view}"
    );
    let token = client
        .post(format!("{session}/token"))
        .send()
        .await
        .unwrap();
    expect(token, StatusCode::OK).await;
}

#[tokio::test]
async fn a_token_ends() {
    let mut app = two_clients().await;
    let id = app.open().await;
    app.track(&id, 1).await;
    for wrong in ["0", "86401", "-1", "ten"] {
        let path = format!("/sessions/{id}/token");
        let request = app.request(Method::POST, &path, &[("seconds", wrong)]);
        expect_problem(request.send().await.unwrap(), "malformed-request").await;
    }
    let made = app.made_token(&id, &[("seconds", "60")]).await;
    let text = made["token"].as_str().unwrap().to_owned();
    assert!(made["expires_at"].as_str().unwrap().ends_with('Z'));
    app.key = Some(text);
    expect(app.get_session(&id).await, StatusCode::OK).await;
    app.clock.advance(Duration::from_secs(61));
    expect_problem(app.get_session(&id).await, "unauthorized").await;
}

#[tokio::test]
async fn the_service_does_not_open_itself_to_a_network_by_accident() {
    for no_auth in [false, true] {
        let mut config = Config {
            listen: "0.0.0.0:0".parse().unwrap(),
            ..Config::default()
        };
        config.access.no_auth = no_auth;
        assert_eq!(Application::bind(config).await.is_ok(), no_auth);
    }
}

#[tokio::test]
async fn a_key_of_the_metrics_is_needed_where_there_is_one_and_good_for_nothing_else() {
    const METRICS: &str = "metrics-metrics-metrics";
    let mut app = TestApplication::start_with(|config| {
        config.access.api_keys = vec![Secret::from("ann:0123456789abcdef")];
        config.access.metrics_key = Some(Secret::from(METRICS));
    })
    .await;
    let id = app.open().await;
    expect_problem(app.get("/metrics").await, "unauthorized").await;
    app.key = None;
    expect_problem(app.get("/metrics").await, "unauthorized").await;
    app.key = Some(METRICS.to_owned());
    assert_eq!(app.get("/metrics").await.status(), StatusCode::OK);
    expect_problem(app.get_session(&id).await, "unauthorized").await;
}
