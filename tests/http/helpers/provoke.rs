//! Provokes each problem by a request that would succeed, but for one fault.

use crate::application::{BOX, TestApplication, behind_a_proxy};
use crate::helpers::heavy;
use crate::helpers::raw::RawConnection;
use crate::operation::metrics::readiness;
use crate::pictures;
use crate::requests::forms::form;
use crate::stream_client::StreamClient;
use bagtrack::http::{Config, SNAPSHOT_MEDIA_TYPE, Secret};
use reqwest::multipart::Part;
use reqwest::{Method, Response, StatusCode};
use std::time::Duration;
use tokio::task::JoinSet;

/// The id of a session that does not exist.
const NEW_ID: &str = "67e55044-10b1-426f-9247-bb680e5fe0c8";

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

    /// The path for the session with this id. The operation that opens a session gets a new id.
    pub fn path_of(&self, id: &str) -> String {
        let opens = self.method == Method::PUT && self.path.ends_with("{id}");
        self.path.replace("{id}", if opens { NEW_ID } else { id })
    }

    pub fn takes_frames(&self) -> bool {
        matches!(self.method, Method::POST | Method::PUT) && !self.path.ends_with("/token")
    }
}

/// A request that is about to fail.
pub struct Attempt {
    app: TestApplication,
    /// The id of a session that has its first frame only.
    id: Option<String>,
    /// Open requests that take places until this is dropped.
    _held: Option<RawConnection>,
    _busy: Option<JoinSet<()>>,
    _stream: Option<StreamClient>,
    method: Method,
    path: String,
    query: Vec<(&'static str, &'static str)>,
    body: Vec<u8>,
    frames: usize,
    media_type: Option<&'static str>,
    idempotency_key: Option<&'static str>,
    /// Sent in the form beside the frame.
    snapshot: Option<Vec<u8>>,
    /// Whether only the head of the request is sent.
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
        "quota-exceeded" => {
            config.limits.client_requests = Some(1);
            // Behind a trusted proxy, the limit applies to a client's streams, not to the proxy's connections.
            config.limits.client_connections = Some(1);
            behind_a_proxy(config);
        }
        "request-too-costly" => {
            config.limits.max_request_pixels = u64::from(pictures::WIDTH * pictures::HEIGHT);
        }
        "store-unavailable" => {
            config.store.store = Some(Secret::from("redis://127.0.0.1:1"));
            config.store.store_timeout = Duration::from_millis(20);
        }
        "not-ready" => config.shutdown_delay = Duration::from_secs(600),
        _ => {}
    }
}

impl Attempt {
    /// Starts a service, and prepares a request to this operation that gets this problem.
    pub async fn provoke(operation: &Operation, slug: &str) -> Self {
        let app = TestApplication::start_with(|config| settings(slug, config)).await;
        // Without the store, no session can be opened.
        let (id, is_open) = match slug == "store-unavailable" {
            true => (NEW_ID.to_owned(), false),
            false => (app.open().await, true),
        };
        let mut attempt = Self {
            app,
            id: is_open.then(|| id.clone()),
            _held: None,
            _busy: None,
            _stream: None,
            method: operation.method.clone(),
            path: operation.path_of(&id),
            query: Vec::new(),
            body: Vec::new(),
            frames: 1,
            media_type: None,
            idempotency_key: None,
            snapshot: None,
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

    #[expect(clippy::too_many_lines, reason = "a list: one arm for each problem")]
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
                let token = self.app.token(self.id.as_ref().unwrap()).await;
                self.app.key = Some(token);
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
                self.path = template.replace("{id}", NEW_ID);
            }
            "session-exists" => {
                let id = self.id.as_ref().unwrap();
                self.path = template.replace("{id}", id);
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
            "unsupported-image" => self.body = b"BM, a bitmap, is not taken".to_vec(),
            "frame-damaged" => self.body.truncate(300),
            "frame-size-mismatch" => {
                self.body = pictures::png_of(64, 48);
                if template == "/track" {
                    let id = self.id.as_ref().unwrap();
                    self.snapshot = Some(self.app.snapshot(id).await);
                    self.query.clear();
                }
            }
            "invalid-box" => self.query = vec![("box", "1000,1000,10,10")],
            "invalid-parameter" => self.query.push(("parameters", r#"{"alpha": 7}"#)),
            "invalid-snapshot" if template == "/track" => {
                self.query.clear();
                self.snapshot = Some(b"no snapshot".to_vec());
            }
            "invalid-snapshot" => {
                self.query.clear();
                self.media_type = Some(SNAPSHOT_MEDIA_TYPE);
            }
            "queue-full" => self._busy = Some(heavy::fill_queue(&self.app).await),
            "request-too-costly" => self.frames = 2,
            "quota-exceeded" if template.ends_with("/stream") => {
                let id = self.id.as_ref().unwrap();
                self._stream = Some(StreamClient::open(self.app.address, id, "").await);
            }
            "session-busy" | "quota-exceeded" | "not-in-order" => {
                let id = self.id.as_ref().unwrap();
                let target = format!("/sessions/{id}/frames");
                let held = RawConnection::hold(self.app.address, "POST", &target, 1000);
                self._held = Some(held.await);
            }
            // A route of the test that panics: every operation answers panics through the same layer.
            "internal" => (self.method, self.path) = (Method::GET, "/panic".to_owned()),
            "not-ready" => {
                self.app.shut_down();
                readiness(&self.app, StatusCode::SERVICE_UNAVAILABLE).await;
            }
            "too-many-sessions" | "store-unavailable" => {}
            other => panic!("nothing provokes {other}: add it here"),
        }
    }

    pub async fn send(&self) -> Response {
        let mut request = self
            .app
            .request(self.method.clone(), &self.path, &self.query);
        if self.path.ends_with("/stream") {
            // The header of a WebSocket handshake; the key may be any 16 bytes.
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
        let request = if self.frames > 1 || self.snapshot.is_some() {
            let frames = form(vec![self.body.clone(); self.frames]);
            let snapshot = self.snapshot.iter();
            request.multipart(snapshot.fold(frames, |form, snapshot| {
                form.part("snapshot", Part::bytes(snapshot.clone()))
            }))
        } else {
            request.body(self.body.clone())
        };
        request.send().await.unwrap()
    }

    /// How many frames the session has taken: a refused request must not change that.
    pub async fn frames_of_the_session(&self) -> Option<u64> {
        match &self.id {
            Some(id) => Some(self.app.frames_of(id).await),
            None => None,
        }
    }
}
