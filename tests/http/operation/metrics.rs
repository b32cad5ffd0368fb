//! `/metrics`, `traceparent`, and readiness.

use crate::application::{TestApplication, expect, expect_detail, expect_problem};
use crate::helpers::heavy;
use crate::pictures;
use bagtrack::http::Secret;
use bagtrack_testing::within::within;
use reqwest::{Method, Response, StatusCode};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

pub async fn metrics(app: &TestApplication) -> String {
    let response = app.get("/metrics").await;
    let media_type = response.headers()["content-type"].to_str().unwrap();
    assert!(
        media_type.starts_with("text/plain; version=0.0.4"),
        "{media_type}"
    );
    response.text().await.unwrap()
}

/// Polls `/readyz` until it answers with this status.
pub async fn readiness(app: &TestApplication, status: StatusCode) -> Response {
    let answer = async {
        loop {
            let response = app.get("/readyz").await;
            if response.status() == status {
                break response;
            }
        }
    };
    within(answer, "readiness changes").await
}

/// The value of the only line that begins with `name` and has all these labels.
pub fn value(text: &str, name: &str, labels: &[&str]) -> f64 {
    let mut lines = text.lines().filter(|line| {
        let (series, _) = line.rsplit_once(' ').unwrap_or((line, ""));
        let (found, rest) = series.split_once('{').unwrap_or((series, ""));
        found == name && labels.iter().all(|label| rest.contains(label))
    });
    let line = lines.next();
    let line = line.unwrap_or_else(|| panic!("{name} {labels:?} is missing:\n{text}"));
    assert_eq!(lines.next(), None, "{name} {labels:?}");
    line.rsplit_once(' ').unwrap().1.parse().unwrap()
}

#[tokio::test]
async fn requests_frames_problems_and_sizes_are_counted() {
    let (app, id) = TestApplication::with_session().await;
    for t in 1..4 {
        app.track(&id, t).await;
    }
    expect_problem(app.post_frame(&id, vec![1]).await, "unsupported-image").await;
    app.get("/nowhere").await;
    app.request(Method::from_bytes(b"INVENTED").unwrap(), "/", &[])
        .send()
        .await
        .unwrap();
    let text = metrics(&app).await;
    let frames = "route=\"/sessions/{id}/frames\"";
    let answered = |labels: &[&str]| value(&text, "bagtrack_http_requests_total", labels);
    assert_eq!(
        answered(&["method=\"POST\"", frames, "status=\"200\""]),
        3.0
    );
    assert_eq!(
        answered(&["method=\"POST\"", frames, "status=\"415\""]),
        1.0
    );
    assert_eq!(answered(&["route=\"none\"", "status=\"404\""]), 1.0);
    assert_eq!(answered(&["method=\"other\"", "status=\"405\""]), 1.0);
    assert!(!text.contains(&id) && !text.contains("nowhere") && !text.contains("INVENTED"));
    let times = |name: &str| value(&text, name, &[]);
    assert_eq!(
        value(
            &text,
            "bagtrack_http_request_duration_seconds_count",
            &[frames]
        ),
        4.0
    );
    assert_eq!(
        value(
            &text,
            "bagtrack_problems_total",
            &["kind=\"unsupported-image\""]
        ),
        1.0
    );
    // Decoded are the three tracked frames and the first one, but not the bad one.
    assert_eq!(times("bagtrack_frame_decode_seconds_count"), 4.0);
    assert_eq!(times("bagtrack_frame_step_seconds_count"), 3.0);
    assert!(times("bagtrack_frame_step_seconds_sum") > 0.0);
    assert_eq!(times("bagtrack_queue_wait_seconds_count"), 5.0);
    assert_eq!(times("bagtrack_sessions"), 1.0);
    assert_eq!(times("bagtrack_workers"), 2.0);
    assert_eq!(times("bagtrack_workers_busy"), 0.0);
    assert!(times("process_resident_memory_bytes") > 1e6);
    let sent: usize = (0..4).map(|t| pictures::png(t).len()).sum();
    assert_eq!(times("bagtrack_received_bytes_total"), (sent + 1) as f64);
    let answers = ["tracking", "uncertain", "lost"].map(|status| {
        value(
            &text,
            "bagtrack_frames_total",
            &[&format!("status=\"{status}\"")],
        )
    });
    assert_eq!(answers.iter().sum::<f64>(), 3.0, "{answers:?}");
}

#[tokio::test]
async fn services_in_one_process_count_for_themselves() {
    let (one, other) = (
        TestApplication::start().await,
        TestApplication::start().await,
    );
    one.open().await;
    assert_eq!(value(&metrics(&one).await, "bagtrack_sessions", &[]), 1.0);
    let text = metrics(&other).await;
    assert_eq!(value(&text, "bagtrack_sessions", &[]), 0.0);
    assert_eq!(
        value(&text, "bagtrack_frame_decode_seconds_count", &[]),
        0.0
    );
}

#[tokio::test]
async fn the_dashboard_and_the_alerts_ask_for_metrics_that_there_are() {
    let app = TestApplication::start().await;
    let with_store = TestApplication::start_with(|config| {
        // No store listens at this address.
        config.store.store = Some(Secret::from("redis://127.0.0.1:1"));
        config.store.store_timeout = Duration::from_millis(20);
    })
    .await;
    let id = app.open().await;
    app.post_frame(&id, pictures::png(1)).await;
    app.post_frame(&id, vec![1]).await;
    metrics(&app).await;
    let text = metrics(&app).await + &metrics(&with_store).await;
    let docker = Path::new(env!("CARGO_MANIFEST_DIR")).join("docker");
    let mut asked = BTreeSet::new();
    for file in ["grafana/bagtrack.json", "prometheus/alerts.yaml"] {
        let text = std::fs::read_to_string(docker.join(file)).unwrap();
        if file.ends_with(".json") {
            serde_json::from_str::<serde_json::Value>(&text).unwrap();
        }
        let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let names =
            words.filter(|word| word.starts_with("bagtrack_") || word.starts_with("process_"));
        asked.extend(names.map(str::to_owned));
    }
    assert!(asked.len() >= 12, "{asked:?}");
    for name in &asked {
        let is_there = text.lines().any(|line| {
            line.strip_prefix(name.as_str())
                .is_some_and(|rest| rest.starts_with(['{', ' ']))
        });
        assert!(is_there, "there is no {name}:\n{text}");
    }
}

#[tokio::test]
async fn the_trace_of_the_client_goes_on_and_every_answer_has_ids() {
    let app = TestApplication::start().await;
    let trace = "4bf92f3577b34da6a3ce929d0e0e4736";
    let sent = format!("00-{trace}-00f067aa0ba902b7-01");
    let get = async |path: &str, value: Option<&str>| {
        let mut request = app.request(Method::GET, path, &[]);
        if let Some(value) = value {
            request = request.header("traceparent", value);
        }
        let response = request.send().await.unwrap();
        assert!(!response.headers()["x-request-id"].is_empty());
        response.headers()["traceparent"]
            .to_str()
            .unwrap()
            .to_owned()
    };
    for path in ["/healthz", "/nowhere", "/panic", "/sessions/x"] {
        let answered = get(path, Some(&sent)).await;
        let fields: Vec<&str> = answered.split('-').collect();
        assert_eq!(
            (fields[0], fields[1], fields[3]),
            ("00", trace, "01"),
            "{path}"
        );
        assert!(
            fields[2].len() == 16 && fields[2] != "00f067aa0ba902b7",
            "{answered}"
        );
    }
    for unusable in [None, Some("00-0-0-00"), Some("garbage")] {
        let (one, other) = (
            get("/healthz", unusable).await,
            get("/healthz", unusable).await,
        );
        assert_eq!((one.len(), &one[..3]), (55, "00-"), "{one}");
        assert_ne!(one[..35], other[..35], "each is a trace of its own");
    }
}

#[tokio::test]
async fn readiness_ends_when_the_queue_is_full_and_comes_back_when_it_is_free() {
    let app = TestApplication::start_with(|config| {
        (config.queue, config.workers) = (1, Some(1));
        config.max_frames = heavy::FRAMES;
    })
    .await;
    expect(app.get("/readyz").await, StatusCode::OK).await;
    let busy = heavy::fill_queue(&app).await;
    // Polls, because the place in the queue is free for a moment between two of the long requests.
    let not_ready = readiness(&app, StatusCode::SERVICE_UNAVAILABLE).await;
    expect_detail(not_ready, "not-ready", &["queue"]).await;
    drop(busy);
    readiness(&app, StatusCode::OK).await;
}
