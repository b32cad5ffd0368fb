//! How each problem is provoked: a request that would succeed, with one thing wrong.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::heavy;
use crate::metrics::{metrics, value};
use crate::pictures;
use crate::raw::RawConnection;
use bagtrack::http::{Config, SNAPSHOT_MEDIA_TYPE, Secret};
use reqwest::multipart::{Form, Part};
use reqwest::{Method, Response, StatusCode};
use std::time::Duration;
use tokio::task::JoinSet;

/// An operation of the OpenAPI document.
#[derive(Clone)]
pub struct Operation {
    pub method: Method,
    pub path: String,
}

impl Operation {
    pub fn new(method: &str, path: &str) -> Self {
        Self {
            method: method.to_uppercase().parse().unwrap(),
            path: path.to_owned(),
        }
    }

    fn takes_frames(&self) -> bool {
        matches!(self.method, Method::POST | Method::PUT) && !self.path.ends_with("/token")
    }
}

/// A request that is about to fail.
pub struct Attempt {
    app: TestApplication,
    /// A session that stands at its first frame.
    id: Option<String>,
    /// Requests that are kept inside.
    _held: Option<RawConnection>,
    _busy: Option<JoinSet<()>>,
    method: Method,
    path: String,
    query: Vec<(&'static str, &'static str)>,
    body: Vec<u8>,
    frames: usize,
    media_type: Option<&'static str>,
    idempotency_key: Option<&'static str>,
    /// Sends the head alone.
    without_body: bool,
}

fn settings(slug: &str, config: &mut Config) {
    match slug {
        "body-timeout" => config.body_timeout = Duration::from_millis(50),
        "body-too-large" => config.max_body_bytes = pictures::png(0).len() + 10,
        "frame-too-large" => config.max_frame_side = pictures::WIDTH,
        "too-many-frames" => config.max_frames = 2,
        "too-many-sessions" => config.max_sessions = 1,
        "session-busy" => config.session_queue = 1,
        "unauthorized" => config.access.api_keys = vec![Secret::from("me:0123456789abcdef")],
        "queue-full" => {
            (config.queue, config.workers) = (1, Some(1));
            config.max_frames = heavy::FRAMES;
        }
        "quota-exceeded" => config.limits.client_requests = Some(1),
        "request-too-costly" => {
            config.limits.max_request_pixels = u64::from(pictures::WIDTH * pictures::HEIGHT);
        }
        "not-ready" => config.shutdown_delay = Duration::from_secs(600),
        _ => {}
    }
}

impl Attempt {
    /// A service and a request to this operation that meets this problem.
    pub async fn provoke(operation: &Operation, slug: &str) -> Self {
        let app = TestApplication::start_with(|config| settings(slug, config)).await;
        let id = app.open().await;
        let mut attempt = Self {
            app,
            id: Some(id.clone()),
            _held: None,
            _busy: None,
            method: operation.method.clone(),
            path: operation.path.replace("{id}", &id),
            query: Vec::new(),
            body: Vec::new(),
            frames: 1,
            media_type: None,
            idempotency_key: None,
            without_body: false,
        };
        if operation.takes_frames() {
            attempt.body = pictures::png(0);
            if !operation.path.ends_with("/frames") {
                attempt.query.push(("box", BOX));
            }
        }
        attempt.spoil(slug, &operation.path).await;
        attempt
    }

    async fn spoil(&mut self, slug: &str, template: &str) {
        match slug {
            "malformed-request" => self.query.push(("colour", "red")),
            "missing-frame" => self.body.clear(),
            "missing-box" => self.query.clear(),
            "unauthorized" => {
                self.app.key = Some("fedcba9876543210".to_owned());
                self.id = None;
            }
            "forbidden" => {
                let path = format!("/sessions/{}/token", self.id.as_ref().unwrap());
                let request = self.app.request(Method::POST, &path, &[]);
                let token = expect(request.send().await.unwrap(), StatusCode::OK).await;
                self.app.key = Some(token["token"].as_str().unwrap().to_owned());
            }
            "session-expired" => {
                self.app.clock.advance(Duration::from_secs(600));
                self.id = None;
            }
            "idempotency-key-reused" => {
                self.idempotency_key = Some("a key");
                let response = self.send().await;
                assert_eq!(
                    response.status(),
                    StatusCode::BAD_REQUEST,
                    "no space is allowed"
                );
                self.idempotency_key = Some("a-key");
                assert_eq!(self.send().await.status(), StatusCode::CREATED);
                self.query = vec![("box", "21,15,16,12")];
            }
            "session-not-found" => {
                self.path = template.replace("{id}", "67e55044-10b1-426f-9247-bb680e5fe0c8");
            }
            "body-timeout" => self.without_body = true,
            "frame-out-of-order" if template.ends_with("/stream") => self.query.push(("from", "9")),
            "frame-out-of-order" => self.query.push(("frame", "9")),
            "frame-differs" => {
                self.query.push(("frame", "0"));
                self.body = pictures::png(5);
            }
            "body-too-large" => self.body.extend([0; 1000]),
            "frame-too-large" => self.body = pictures::png_of(pictures::WIDTH + 1, 72),
            "too-many-frames" => self.frames = 3,
            "unsupported-image" => self.body = b"GIF89a is not taken".to_vec(),
            "frame-damaged" => self.body.truncate(300),
            "frame-size-mismatch" => self.body = pictures::png_of(64, 48),
            "invalid-box" => self.query = vec![("box", "1000,1000,10,10")],
            "invalid-parameter" => self.query.push(("params", r#"{"alpha": 7}"#)),
            "invalid-snapshot" => {
                self.query.clear();
                self.media_type = Some(SNAPSHOT_MEDIA_TYPE);
            }
            "queue-full" => self._busy = Some(heavy::fill_queue(&self.app).await),
            "request-too-costly" => self.frames = 2,
            "session-busy" | "quota-exceeded" | "not-in-order" => {
                let id = self.id.as_ref().unwrap();
                let target = format!("/sessions/{id}/frames");
                let held = RawConnection::hold(self.app.address, "POST", &target, 1000);
                self._held = Some(held.await);
            }
            // Every operation answers a panic through the same layer; no input makes the real ones panic.
            "internal" => (self.method, self.path) = (Method::GET, "/panic".to_owned()),
            "not-ready" => {
                self.app.shut_down();
                while self.app.get("/readyz").await.status() == StatusCode::OK {}
            }
            "too-many-sessions" => {}
            other => panic!("nothing provokes {other}: add it here"),
        }
    }

    pub async fn send(&self) -> Response {
        let mut request = self
            .app
            .request(self.method.clone(), &self.path, &self.query);
        if self.path.ends_with("/stream") {
            // What opens a WebSocket; the key may be any 16 bytes.
            request = request
                .header("connection", "upgrade")
                .header("upgrade", "websocket")
                .header("sec-websocket-version", "13")
                .header("sec-websocket-key", "AAAAAAAAAAAAAAAAAAAAAA==");
        }
        if self.without_body {
            let never = futures_util::stream::pending::<Result<Vec<u8>, std::io::Error>>();
            return request
                .body(reqwest::Body::wrap_stream(never))
                .send()
                .await
                .unwrap();
        }
        if let Some(media_type) = self.media_type {
            request = request.header("content-type", media_type);
        }
        if let Some(key) = self.idempotency_key {
            request = request.header("idempotency-key", key);
        }
        let request = if self.frames > 1 {
            let part = || Part::bytes(self.body.clone()).file_name("frame.png");
            let form = (0..self.frames).fold(Form::new(), |form, _| form.part("frame", part()));
            request.multipart(form)
        } else {
            request.body(self.body.clone())
        };
        request.send().await.unwrap()
    }

    /// Frames that the session has taken: the problem must not have changed it.
    pub async fn frames_of_the_session(&self) -> Option<u64> {
        match &self.id {
            Some(id) => Some(self.app.frames_of(id).await),
            None => None,
        }
    }
}

/// A service whose only worker can be kept busy for longer than a request may take.
pub struct Blocked {
    app: TestApplication,
    id: String,
    bomb: Vec<u8>,
}

impl Blocked {
    pub async fn start() -> Self {
        let app = TestApplication::start_with(|config| {
            config.workers = Some(1);
            config.work_timeout = Duration::from_millis(20);
            // So that the large frame is decoded.
            config.max_frame_memory = 1 << 30;
        });
        let app = app.await;
        let opened = loop {
            let opened = app.create(pictures::png(0), &[("box", BOX)]).await;
            if opened.status() == StatusCode::CREATED {
                break opened.json::<serde_json::Value>().await.unwrap();
            }
        };
        Self {
            id: opened["id"].as_str().unwrap().to_owned(),
            bomb: heavy::bomb(),
            app,
        }
    }

    /// The answers to these operations, sent while the worker decodes one large frame. None, where it had decoded that
    /// before all of them were answered.
    pub async fn attempts(&self, operations: &[Operation]) -> Option<Vec<Response>> {
        let block = async {
            loop {
                let frame = self.bomb.clone();
                let query = [("box", "2000,1500,1600,1200")];
                let late = self.app.create(frame, &query).await;
                expect_problem(late, "work-timeout").await;
            }
        };
        let attempts = async {
            let begun = loop {
                if let Some(begun) = self.begun_at_work().await {
                    break begun;
                }
            };
            let attempts = operations.iter().map(|operation| self.attempt(operation));
            let responses = futures_util::future::join_all(attempts).await;
            // Nothing else has begun, so the worker was never free.
            (self.begun_at_work().await == Some(begun)).then_some(responses)
        };
        tokio::select! {
            responses = attempts => responses,
            () = block => None,
        }
    }

    /// How many pieces of work have begun, if the worker is at one of them.
    async fn begun_at_work(&self) -> Option<f64> {
        let text = metrics(&self.app).await;
        let is_busy = value(&text, "bagtrack_workers_busy", &[]) == 1.0;
        is_busy.then(|| value(&text, "bagtrack_queue_wait_seconds_count", &[]))
    }

    async fn attempt(&self, operation: &Operation) -> Response {
        let path = operation.path.replace("{id}", &self.id);
        // Numbered, since frames without numbers may not come at once.
        let query: &[(&str, &str)] = match (operation.takes_frames(), operation.path.as_str()) {
            (false, _) => &[],
            (_, path) if path.ends_with("/frames") => &[("frame", "1")],
            (_, path) if path.ends_with("/target") => &[("box", BOX), ("frame", "1")],
            _ => &[("box", BOX)],
        };
        let mut request = self.app.request(operation.method.clone(), &path, query);
        if operation.takes_frames() {
            request = request.body(pictures::png(0));
        }
        request.send().await.unwrap()
    }

    /// What timed out while it waited was not done.
    pub async fn finish(self) {
        while self.begun_at_work().await.is_some() {}
        assert_eq!(self.app.frames_of(&self.id).await, 1);
        let text = metrics(&self.app).await;
        assert_eq!(value(&text, "bagtrack_sessions", &[]), 1.0);
    }
}
