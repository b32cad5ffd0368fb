//! The network between callers and replicas.

use crate::cluster::Cluster;
use crate::journal::{Given, Journal};
use crate::replay;
use axum::body::Body;
use bagtrack_client::Network;
use bagtrack_sessions::clock::{sleep, timeout};
use bytes::Bytes;
use http::header::HeaderMap;
use http_body_util::BodyExt;
use std::future::pending;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

/// The network, as one caller meets it.
#[derive(Debug, Clone)]
pub struct Wire {
    /// The caller's name, for the trace.
    pub caller: String,
    /// The replicas at its other end.
    pub cluster: Cluster,
    /// The journal that checks the replicas' answers.
    pub journal: Journal,
}

/// The copy of a request, which can be sent several times.
#[derive(Debug, Clone)]
struct Letter {
    method: http::Method,
    url: reqwest::Url,
    headers: HeaderMap,
    body: Bytes,
}

/// The connection broke before the whole answer had come.
#[derive(Debug)]
struct Broken;

impl Letter {
    async fn of(mut request: reqwest::Request) -> Self {
        let body = match request.body_mut().take() {
            None => Bytes::new(),
            Some(body) => {
                let whole = body.collect().await;
                whole.expect("it is in memory").to_bytes()
            }
        };
        Self {
            method: request.method().clone(),
            url: request.url().clone(),
            headers: request.headers().clone(),
            body,
        }
    }

    fn request(&self, id: u128) -> http::Request<Body> {
        let path = match self.url.query() {
            Some(query) => format!("{}?{query}", self.url.path()),
            None => self.url.path().to_owned(),
        };
        let mut request = http::Request::new(Body::from(self.body.clone()));
        *request.method_mut() = self.method.clone();
        *request.uri_mut() = path.parse().expect("a path");
        *request.headers_mut() = self.headers.clone();
        let headers = request.headers_mut();
        headers.insert("host", http::HeaderValue::from_static("localhost"));
        headers.insert("content-length", self.body.len().into());
        let id = format!("{id:032x}").parse().expect("visible characters");
        headers.insert("x-request-id", id);
        request
    }

    /// A digest of the request's parts on which its answer depends.
    fn digest(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        let others = self.url.query_pairs().filter(|(name, _)| name != "frame");
        others.for_each(|pair| pair.hash(&mut hasher));
        self.body.hash(&mut hasher);
        hasher.finish()
    }
}

impl Wire {
    /// The index of the replica to which a request goes: the one that the address names, or any that is ready.
    fn place(&self, letter: &Letter) -> Option<usize> {
        match letter.url.host_str()?.strip_prefix("replica-") {
            Some(index) => index.parse().ok(),
            None => {
                let ready = self.cluster.ready();
                let chance = &self.cluster.setup().chance;
                (!ready.is_empty()).then(|| *chance.one_of(&ready))
            }
        }
    }

    async fn carry(&self, letter: Letter) -> Result<http::Response<Bytes>, Broken> {
        let setup = self.cluster.setup();
        let (rates, chance) = (&setup.rates, &setup.chance);
        let latency = || match rates.happens(chance, rates.request_late) {
            true => chance.millis(50..4000),
            false => chance.millis(0..5),
        };
        sleep(latency()).await;
        let replica = self.place(&letter).and_then(|index| self.cluster.at(index));
        let replica = replica.ok_or(Broken)?;
        if rates.happens(chance, rates.request_lost) {
            return self.lose("request").await;
        }
        let (method, path) = (&letter.method, letter.url.path());
        let number = letter.url.query_pairs().find(|(name, _)| name == "frame");
        let number = number.map_or_else(String::new, |(_, number)| number.into_owned());
        setup.trace.note(format_args!(
            "{} to {}: {method} {path} {number}",
            self.caller, replica.name
        ));
        if rates.happens(chance, rates.request_doubled) {
            self.send_again_later(&letter);
        }
        let (answer, client) = replica.answer(letter.request(chance.number()));
        if chance.happens(0.3) {
            client.detach();
            return self
                .finish(&letter, answer.await.map_err(|_| Broken)?, latency())
                .await;
        }
        let answer = answer.await.map_err(|_| Broken)?;
        drop(client);
        self.finish(&letter, answer, latency()).await
    }

    async fn finish(
        &self,
        letter: &Letter,
        answer: http::Response<Bytes>,
        latency: Duration,
    ) -> Result<http::Response<Bytes>, Broken> {
        let setup = self.cluster.setup();
        self.note(letter, &answer);
        sleep(latency).await;
        match setup.rates.happens(&setup.chance, setup.rates.answer_lost) {
            true => self.lose("answer").await,
            false => Ok(answer),
        }
    }

    async fn lose<T>(&self, what: &str) -> Result<T, Broken> {
        let setup = self.cluster.setup();
        setup
            .trace
            .note(format_args!("{}: {what} lost", self.caller));
        match setup.chance.happens(0.7) {
            true => Err(Broken),
            false => pending().await,
        }
    }

    /// Sends a request once more after a while, as a proxy on the way may.
    fn send_again_later(&self, letter: &Letter) {
        let (wire, letter) = (self.clone(), letter.clone());
        let chance = self.cluster.setup().chance.clone();
        tokio::spawn(async move {
            sleep(chance.millis(0..500)).await;
            let place = wire.place(&letter);
            let Some(replica) = place.and_then(|index| wire.cluster.at(index)) else {
                return;
            };
            let (answer, client) = replica.answer(letter.request(chance.number()));
            client.detach();
            if let Ok(answer) = answer.await {
                wire.note(&letter, &answer);
            }
        });
    }

    /// Journals an answer if it is one to frames, whether its caller gets it or not.
    fn note(&self, letter: &Letter, answer: &http::Response<Bytes>) {
        let setup = self.cluster.setup();
        let told: serde_json::Value = serde_json::from_slice(answer.body()).unwrap_or_default();
        let kind = told["type"].as_str().unwrap_or_default();
        setup.trace.note(format_args!(
            "{}: {} {} {kind}{}",
            self.caller,
            letter.url.path(),
            answer.status(),
            told["frame"]
        ));
        let mut path = letter.url.path().split('/').skip(2);
        let Some(session) = path.next().map(str::to_owned) else {
            return;
        };
        let is_of_frames = matches!(path.next(), None | Some("frames" | "target"));
        if !is_of_frames || !answer.status().is_success() || told["frame"].is_null() {
            return;
        }
        let header = answer.headers().get("checkpoint");
        let checkpoint = header.and_then(|value| value.to_str().ok()?.parse().ok());
        let all = told["answers"].as_array().cloned();
        let all = all
            .filter(|all| !all.is_empty())
            .unwrap_or_else(|| vec![told]);
        for (index, one) in all.iter().enumerate() {
            let given = Given {
                session: session.clone(),
                frame: one["frame"].as_u64().unwrap_or(u64::MAX),
                sent: letter.digest().wrapping_add(index as u64),
                answer: text(one),
                checkpoint,
            };
            let writes_each = setup.store_every == 1;
            self.journal
                .answered(given, setup.store.is_some(), writes_each);
        }
    }
}

/// An answer (box, score and status) in one line.
pub(crate) fn text(answer: &serde_json::Value) -> String {
    let side = |name: &str| answer["box"][name].as_f64().unwrap_or(f64::NAN);
    let rect = [side("x"), side("y"), side("width"), side("height")].into();
    let score = answer["score"].as_f64().unwrap_or(f64::NAN);
    replay::text(rect, score, answer["status"].as_str().unwrap_or_default())
}

impl Network for Wire {
    fn send(
        &self,
        request: reqwest::Request,
    ) -> Pin<Box<dyn Future<Output = reqwest::Response> + Send + '_>> {
        let longest = request.timeout().copied();
        Box::pin(async move {
            let letter = Letter::of(request).await;
            let carried = self.carry(letter);
            let carried = match longest {
                Some(longest) => timeout(longest, carried).await.unwrap_or(Err(Broken)),
                None => carried.await,
            };
            match carried {
                Ok(answer) => answer.into(),
                Err(Broken) => broken().into(),
            }
        })
    }

    fn random(&self) -> u128 {
        self.cluster.setup().chance.number()
    }
}

/// An answer whose body breaks off before its first byte.
fn broken() -> http::Response<reqwest::Body> {
    http::Response::new(reqwest::Body::wrap(BrokenBody))
}

struct BrokenBody;

impl http_body::Body for BrokenBody {
    type Data = Bytes;
    type Error = std::io::Error;

    fn poll_frame(
        self: Pin<&mut Self>,
        _: &mut Context,
    ) -> Poll<Option<Result<http_body::Frame<Bytes>, std::io::Error>>> {
        Poll::Ready(Some(Err(std::io::ErrorKind::ConnectionReset.into())))
    }
}
