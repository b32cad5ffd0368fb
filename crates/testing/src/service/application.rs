//! The service on a free port in this process, with a method for each kind of request.

use crate::pictures;
use bagtrack::http::{Application, Config};
use bagtrack_sessions::Clock;
use reqwest::{Client, Method, RequestBuilder, Response, StatusCode, Url};
use serde_json::Value;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// The box of the target in `pictures::scene(0)`.
pub const BOX: &str = "20,15,16,12";

/// Trusts this machine as a proxy, so that tests can name the client of a request in `X-Forwarded-For`.
pub fn behind_a_proxy(config: &mut Config) {
    config.limits.trusted_proxies = vec!["127.0.0.0/8".parse().unwrap()];
}

/// Limits the bytes of each body and of all bodies together; one client may use all of them.
pub fn bound_bodies(config: &mut Config, each: usize, all: usize) {
    config.max_body_bytes = each;
    config.max_upload_bytes = all;
    config.limits.client_upload_bytes = Some(all);
}

pub struct TestApplication {
    pub address: SocketAddr,
    pub client: Client,
    pub clock: Clock,
    /// The API key or session token that requests are sent with.
    pub key: Option<String>,
    stop: Option<oneshot::Sender<()>>,
    served: JoinHandle<bool>,
}

impl TestApplication {
    /// Starts with the default settings.
    pub async fn start() -> Self {
        Self::start_with(|_| ()).await
    }

    /// Starts with the default settings, and opens a session. Returns its id, too.
    pub async fn with_session() -> (Self, String) {
        let app = Self::start().await;
        let id = app.open().await;
        (app, id)
    }

    /// Starts with other settings. Time limits are long, so that a busy machine does not fail a test.
    pub async fn start_with(change: impl FnOnce(&mut Config)) -> Self {
        let mut config = Config {
            listen: "127.0.0.1:0".parse().unwrap(),
            workers: Some(2),
            // Long enough that a busy machine does not refuse requests.
            queue_delay: Duration::from_secs(10),
            body_timeout: Duration::from_secs(60),
            work_timeout: Duration::from_secs(60),
            shutdown_delay: Duration::ZERO,
            ..Config::default()
        };
        change(&mut config);
        let first = config.access.api_keys.first();
        let key = first.and_then(|named| named.text().split_once(':'));
        let key = key.map(|(_, key)| key.to_owned());
        let clock = Clock::default();
        let application = Application::bind_with_clock(config, clock.clone());
        let application = application.await.expect("a free port");
        let panics = axum::routing::get(async || -> () { panic!("a test panics in a handler") });
        let application = application.with_routes(axum::Router::new().route("/panic", panics));
        let (stop, stopped) = oneshot::channel::<()>();
        Self {
            address: application.local_addr().unwrap(),
            client: Client::new(),
            clock,
            key,
            stop: Some(stop),
            served: tokio::spawn(application.serve(async {
                let _ = stopped.await;
            })),
        }
    }

    /// Asks the service to end.
    pub fn shut_down(&mut self) {
        let stop = self.stop.take().expect("asked once");
        stop.send(()).unwrap();
    }

    /// Waits for the end of the service. Returns whether all open requests ended in time.
    pub async fn ended(self) -> bool {
        self.served.await.unwrap()
    }

    /// Asks the service to end, and waits for it. Returns whether all open requests ended in time.
    pub async fn end(mut self) -> bool {
        self.shut_down();
        self.ended().await
    }

    pub fn request(&self, method: Method, path: &str, query: &[(&str, &str)]) -> RequestBuilder {
        let url = format!("http://{}{path}", self.address);
        let url = match query {
            [] => Url::parse(&url),
            query => Url::parse_with_params(&url, query),
        };
        let request = self.client.request(method, url.unwrap());
        match &self.key {
            Some(key) => request.bearer_auth(key),
            None => request,
        }
    }

    pub async fn get(&self, path: &str) -> Response {
        self.request(Method::GET, path, &[]).send().await.unwrap()
    }

    /// `POST /sessions` with a raw body.
    pub async fn create(&self, frame: Vec<u8>, query: &[(&str, &str)]) -> Response {
        let request = self.request(Method::POST, "/sessions", query);
        request.body(frame).send().await.unwrap()
    }

    /// Opens a session on the first drawn frame with these settings. Returns the answer.
    pub async fn opened(&self, query: &[(&str, &str)]) -> Value {
        let response = self.create(pictures::png(0), query).await;
        expect(response, StatusCode::CREATED).await
    }

    /// Opens a session with [`BOX`] and seed 7. Returns its id.
    pub async fn open(&self) -> String {
        let created = self.opened(&[("box", BOX), ("seed", "7")]).await;
        created["id"].as_str().unwrap().to_owned()
    }

    /// `POST /sessions` with this address of the client in `X-Forwarded-For`.
    pub async fn create_as(&self, client: &str) -> Response {
        let request = self.request(Method::POST, "/sessions", &[("box", BOX)]);
        let request = request.header("x-forwarded-for", client);
        request.body(pictures::png(0)).send().await.unwrap()
    }

    /// `POST /sessions/{id}/frames`, to which the caller adds a body.
    pub fn frames_request(&self, id: &str, query: &[(&str, &str)]) -> RequestBuilder {
        self.request(Method::POST, &format!("/sessions/{id}/frames"), query)
    }

    pub async fn post_frame(&self, id: &str, frame: Vec<u8>) -> Response {
        let request = self.frames_request(id, &[]);
        request.body(frame).send().await.unwrap()
    }

    /// Posts drawn frame `t`, which must be accepted. Returns the answer.
    pub async fn track(&self, id: &str, t: u32) -> Value {
        expect(self.post_frame(id, pictures::png(t)).await, StatusCode::OK).await
    }

    /// `POST /sessions/{id}/frames?frame=N` with a raw body.
    pub async fn post_numbered(&self, id: &str, number: u64, frame: Vec<u8>) -> Response {
        let number = number.to_string();
        let request = self.frames_request(id, &[("frame", &number)]);
        request.body(frame).send().await.unwrap()
    }

    /// `PUT /sessions/{id}/target` with a raw body.
    pub async fn put_target(&self, id: &str, frame: Vec<u8>, query: &[(&str, &str)]) -> Response {
        let path = format!("/sessions/{id}/target");
        let request = self.request(Method::PUT, &path, query);
        request.body(frame).send().await.unwrap()
    }

    pub async fn get_session(&self, id: &str) -> Response {
        self.get(&format!("/sessions/{id}")).await
    }

    /// The number of frames that the session has taken.
    pub async fn frames_of(&self, id: &str) -> u64 {
        let view = expect(self.get_session(id).await, StatusCode::OK).await;
        view["frames"].as_u64().unwrap()
    }

    pub async fn delete_session(&self, id: &str) -> Response {
        let request = self.request(Method::DELETE, &format!("/sessions/{id}"), &[]);
        request.send().await.unwrap()
    }

    /// `POST /sessions/{id}/token`, which must succeed. Returns the answer.
    pub async fn made_token(&self, id: &str, query: &[(&str, &str)]) -> Value {
        let request = self.request(Method::POST, &format!("/sessions/{id}/token"), query);
        expect(request.send().await.unwrap(), StatusCode::OK).await
    }

    /// A token for this session alone.
    pub async fn token(&self, id: &str) -> String {
        let made = self.made_token(id, &[]).await;
        made["token"].as_str().unwrap().to_owned()
    }

    /// `GET /sessions/{id}/snapshot`.
    pub async fn snapshot_of(&self, id: &str) -> Response {
        self.get(&format!("/sessions/{id}/snapshot")).await
    }

    /// The bytes of a snapshot of a session.
    pub async fn snapshot(&self, id: &str) -> Vec<u8> {
        let response = self.snapshot_of(id).await;
        assert_eq!(response.status(), StatusCode::OK);
        let media_type = bagtrack::http::SNAPSHOT_MEDIA_TYPE;
        assert_eq!(response.headers()["content-type"], media_type);
        response.bytes().await.unwrap().to_vec()
    }
}

/// The JSON of a response that must have this status.
pub async fn expect(response: Response, status: StatusCode) -> Value {
    let got = response.status();
    let text = response.text().await.unwrap();
    assert_eq!(got, status, "{text}");
    serde_json::from_str(&text).unwrap_or(Value::Null)
}

/// The `detail` of a response, which must be this problem and contain these texts.
pub async fn expect_detail(response: Response, slug: &str, says: &[&str]) -> String {
    let problem = expect_problem(response, slug).await;
    let detail = problem["detail"].as_str().unwrap().to_owned();
    for text in says {
        assert!(detail.contains(text), "{text}: {detail}");
    }
    detail
}

/// The JSON of a response that must be this problem.
pub async fn expect_problem(response: Response, slug: &str) -> Value {
    let headers = response.headers().clone();
    let status = response.status().as_u16();
    let path = response.url().path().to_owned();
    let text = response.text().await.unwrap();
    let problem: Value = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{status}: {text}"));
    let kind = problem["type"].as_str().unwrap();
    let (base, name) = kind.split_once("/docs/problems#").expect(kind);
    assert_eq!(name, slug, "{text}");
    assert!(problem["instance"].as_str().unwrap().starts_with(base));
    assert_eq!(headers["content-type"], "application/problem+json");
    assert_eq!(problem["status"], status);
    assert_eq!(problem["instance"], path);
    assert_eq!(
        problem["request_id"],
        headers["x-request-id"].to_str().unwrap()
    );
    assert!(!problem["title"].as_str().unwrap().is_empty());
    assert!(!problem["detail"].as_str().unwrap().is_empty());
    let may_retry = matches!(status, 429 | 503);
    assert_eq!(headers.contains_key("retry-after"), may_retry, "{text}");
    problem
}
