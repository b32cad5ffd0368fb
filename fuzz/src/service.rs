//! The service, and the checks of each of its answers.

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, Method, Request, StatusCode};
use axum::Router;
use bagtrack::http::{Config, Parts};
use bagtrack_sessions::{
    Clock, Executor, MacKeys, SessionStore, MAC_BYTES, SNAPSHOT_KEY_CONTEXT, SNAPSHOT_MAGIC,
};
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use flate2::Compression;
use http_body_util::BodyExt;
use serde_json::Value;
use std::cell::Cell;
use std::convert::Infallible;
use std::future::Future;
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;
use tower::ServiceExt;

/// Requests after which the samples of the histograms are summed up; a served application does that by the clock.
const REQUESTS_BETWEEN_UPKEEP: u32 = 1000;

/// The service in this process.
pub struct Service {
    runtime: Runtime,
    router: Router,
    /// Whether the service may answer that a record of the store cannot be read.
    has_store: bool,
    requests: Cell<u32>,
}

pub struct Answer {
    pub status: StatusCode,
    pub headers: HeaderMap,
    pub body: Bytes,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("the answer is JSON")
    }

    /// The path of the session that was opened, if one was.
    pub fn session(&self) -> Option<String> {
        let path = self.headers.get("location")?;
        Some(path.to_str().expect("a path is text").to_owned())
    }
}

impl Service {
    /// A service without a store. A panic that the service turns into an answer counts as that answer.
    pub fn new() -> Self {
        // Replaces libFuzzer's hook, which aborts at every panic, also at those of decoders, which the service catches.
        std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
        Self::on(new_runtime(), None)
    }

    /// A service with this store. Every panic is a finding.
    pub fn with_store<S: SessionStore + Clone + 'static>(
        store: impl Future<Output = S>,
    ) -> (Self, S) {
        let runtime = new_runtime();
        let store = runtime.block_on(store);
        (Self::on(runtime, Some(Arc::new(store.clone()))), store)
    }

    fn on(runtime: Runtime, store: Option<Arc<dyn SessionStore>>) -> Self {
        let has_store = store.is_some();
        let router = runtime.block_on(async {
            let parts = Parts {
                clock: Clock::default(),
                store,
                expert: None,
                // Work runs on this thread, so that the same input has the same effect.
                executor: Executor::on_one_thread(|work| {
                    tokio::spawn(async move { work()() });
                }),
            };
            let service = bagtrack::http::Service::new(config(), parts);
            let service = service.expect("the settings are valid");
            service.router(SocketAddr::from((Ipv4Addr::LOCALHOST, 1)))
        });
        Self {
            runtime,
            router,
            has_store,
            requests: Cell::new(0),
        }
    }

    /// Runs a future to its end in the service's runtime.
    pub fn wait<T>(&self, what: impl Future<Output = T>) -> T {
        self.runtime.block_on(what)
    }

    /// Sends a request whose body arrives in pieces of `piece` bytes. Every answer is success, or a problem document:
    /// of the client's doing, or about what a store has.
    pub fn send_in_pieces(
        &self,
        (method, path): (Method, &str),
        media_type: &str,
        body: &[u8],
        piece: usize,
    ) -> Answer {
        let pieces: Vec<Result<Bytes, Infallible>> = body
            .chunks(piece.max(1))
            .map(|piece| Ok(Bytes::copy_from_slice(piece)))
            .collect();
        let body = Body::from_stream(futures_util::stream::iter(pieces));
        let request = Request::builder()
            .method(method)
            .uri(path)
            .header("host", "localhost");
        let request = request.header("content-type", media_type).body(body);
        let request = request.expect("the path and the type are valid");
        let answer = self.runtime.block_on(async {
            let answer = self.router.clone().oneshot(request).await;
            let (head, body) = answer.expect("it cannot fail").into_parts();
            let body = body.collect().await.expect("answers come from memory");
            Answer {
                status: head.status,
                headers: head.headers,
                body: body.to_bytes(),
            }
        });
        let text = || String::from_utf8_lossy(&answer.body).into_owned();
        let is_failure = answer.status.is_server_error();
        assert!(
            !is_failure || self.has_store,
            "{}: {}",
            answer.status,
            text()
        );
        if answer.status.is_client_error() || is_failure {
            assert_eq!(
                answer.headers["content-type"],
                "application/problem+json",
                "{}",
                text()
            );
            assert_eq!(answer.json()["status"], answer.status.as_u16());
        }
        self.requests.set(self.requests.get() + 1);
        if self.requests.get() == REQUESTS_BETWEEN_UPKEEP {
            self.send((Method::GET, "/metrics"), "text/plain", b"");
            self.requests.set(0);
        }
        answer
    }

    pub fn send(&self, target: (Method, &str), media_type: &str, body: &[u8]) -> Answer {
        self.send_in_pieces(target, media_type, body, body.len())
    }

    /// Opens a session with this body and sends it the same body as its next frames; ends the session.
    pub fn upload_twice(&self, query: &str, media_type: &str, body: &[u8], piece: usize) {
        let create = format!("/sessions{query}");
        let created = self.send_in_pieces((Method::POST, &create), media_type, body, piece);
        let Some(session) = created.session() else {
            return;
        };
        let post = format!("{session}/frames");
        let posted = self.send_in_pieces((Method::POST, &post), media_type, body, piece);
        let taken = match posted.status.is_success() {
            true => posted.json()["answers"].as_array().map_or(1, Vec::len) as u64,
            false => 0,
        };
        assert_eq!(self.frames(&session), Some(1 + taken), "{session}");
        self.delete(&session);
    }

    /// How many frames a session has taken; `None` if there is no such session.
    pub fn frames(&self, session: &str) -> Option<u64> {
        let view = self.send((Method::GET, session), "text/plain", b"");
        match view.status {
            StatusCode::OK => Some(view.json()["frames"].as_u64().expect("a number")),
            _ => None,
        }
    }

    pub fn delete(&self, session: &str) {
        let deleted = self.send((Method::DELETE, session), "text/plain", b"");
        assert_eq!(deleted.status, StatusCode::NO_CONTENT);
    }
}

impl Default for Service {
    fn default() -> Self {
        Self::new()
    }
}

/// Settings with small limits, so that inputs can be small, too.
fn config() -> Config {
    let mut config = Config {
        workers: Some(1),
        max_sessions: 64,
        max_body_bytes: 1 << 20,
        max_frame_side: 1024,
        max_frame_pixels: 1 << 20,
        max_frame_memory: 32 << 20,
        max_frames: 4,
        // Long times, since a sanitizer makes work slow.
        work_timeout: Duration::from_secs(600),
        ..Config::default()
    };
    config.access.unsigned_snapshots = true;
    config.limits.max_request_cpu = Duration::from_secs(600);
    // Requests without a connection come from 0.0.0.0; a trusted proxy may ask as often as it likes.
    config.limits.trusted_proxies = vec!["0.0.0.0/0".parse().expect("all addresses")];
    config
}

fn new_runtime() -> Runtime {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    runtime.expect("the system gives a runtime")
}

/// Bytes of the length of a state's content, which come before it.
const LENGTH_BYTES: usize = 4;

/// The version and the uncompressed content of a snapshot.
pub fn content_of(snapshot: &[u8]) -> io::Result<(u8, Vec<u8>)> {
    content_of_stored(&snapshot[..snapshot.len() - MAC_BYTES])
}

/// The version and the uncompressed content of a stored state.
pub fn content_of_stored(state: &[u8]) -> io::Result<(u8, Vec<u8>)> {
    let version = SNAPSHOT_MAGIC.len();
    let compressed = &state[version + 1 + LENGTH_BYTES..];
    let mut content = Vec::new();
    DeflateDecoder::new(compressed).read_to_end(&mut content)?;
    Ok((state[version], content))
}

/// A stored state with these bytes as its content, which is not compressed.
pub fn stored_of(version: u8, content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::none());
    let written = encoder.write_all(content);
    written.expect("a vector takes all bytes");
    let compressed = encoder.finish().expect("a vector takes all bytes");
    let length = content.len() as u32;
    let length = length.to_le_bytes();
    [SNAPSHOT_MAGIC, &[version], &length, &compressed].concat()
}

/// A snapshot with these bytes as its content, with the code of unsigned ones.
pub fn snapshot_of(version: u8, content: &[u8]) -> Vec<u8> {
    let none: &[&str] = &[];
    let keys = MacKeys::new(SNAPSHOT_KEY_CONTEXT, none).accepting_unsigned(false);
    let mut bytes = stored_of(version, content);
    let code = keys.sign(&bytes);
    bytes.extend_from_slice(&code);
    bytes
}
