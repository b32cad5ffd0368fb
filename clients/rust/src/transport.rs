//! Requests over HTTP, which are sent again after temporary failures.

use crate::backoff::Backoff;
use crate::error::{ClientError, causes};
use crate::network::Carrier;
use bagtrack_api::ProblemDocument as Problem;
use bagtrack_api::headers::{CHECKPOINT, DRAINING};
use bagtrack_api::media_types::SNAPSHOT;
use bytes::Bytes;
use reqwest::header::{
    AUTHORIZATION, CONTENT_TYPE, DATE, HeaderMap, HeaderName, HeaderValue, RETRY_AFTER,
};
use reqwest::multipart::{Form, Part};
use reqwest::{Method, StatusCode, Url};
use serde::de::Error;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// Names and values of query parameters.
pub type Query = Vec<(&'static str, String)>;

/// A request; it may be sent several times.
pub struct Request {
    pub method: Method,
    /// The path below the service's address.
    pub path: String,
    pub query: Query,
    pub body: Body,
}

impl Request {
    /// A request without query and body.
    pub fn bare(method: Method, path: String) -> Self {
        let (query, body) = (Query::new(), Body::Empty);
        Self {
            method,
            path,
            query,
            body,
        }
    }
}

/// The body of a request.
pub enum Body {
    Empty,
    /// Bytes of this media type.
    Bytes(&'static str, Bytes),
    /// Several frames.
    Frames(Vec<Bytes>),
}

impl Body {
    /// Additional time for the body over a slow connection.
    fn time(&self) -> Duration {
        let bytes: usize = match self {
            Self::Empty => 0,
            Self::Bytes(_, bytes) => bytes.len(),
            Self::Frames(frames) => frames.iter().map(Bytes::len).sum(),
        };
        Duration::from_millis(bytes as u64 / 50)
    }
}

/// What the headers of an answer say of the session.
#[derive(Debug, Clone, Copy, Default)]
pub struct Standing {
    /// The last frame whose state is in the store.
    pub checkpoint: Option<u64>,
    /// Whether the service is about to end.
    pub draining: bool,
}

/// The answer to a request.
pub struct Reply {
    pub status: StatusCode,
    pub headers: HeaderMap,
    pub body: Bytes,
}

impl Reply {
    /// The answer if its status is success; else its problem.
    pub fn checked(self) -> Result<Self, Box<Problem>> {
        match self.status.is_success() {
            true => Ok(self),
            false => Err(Box::new(self.problem())),
        }
    }

    /// The snapshot.
    ///
    /// # Errors
    /// The body is no snapshot, but for example a page of a proxy.
    pub fn snapshot(self) -> Result<Bytes, ClientError> {
        let came = self.headers.get(CONTENT_TYPE);
        match came.is_some_and(|came| came == SNAPSHOT) {
            true => Ok(self.body),
            false => Err(serde_json::Error::custom(format!("{came:?} is no snapshot")).into()),
        }
    }

    /// The problem document; for an error page of a proxy, one with the status only.
    fn problem(&self) -> Problem {
        let problem = serde_json::from_slice(&self.body).unwrap_or_else(|_| Problem {
            title: self
                .status
                .canonical_reason()
                .unwrap_or("an error")
                .to_owned(),
            ..Problem::default()
        });
        Problem {
            status: self.status.as_u16(),
            retry_after: self.retry_after(),
            ..problem
        }
    }

    /// The header `Retry-After`: seconds, or, from some proxies, a date.
    fn retry_after(&self) -> Option<Duration> {
        let seconds = self.number(RETRY_AFTER.as_str());
        seconds.map(Duration::from_secs).or_else(|| {
            let until = self.date(RETRY_AFTER)?;
            // Counts from the `Date` of the answer, since the clock of this machine may be wrong.
            let now = self.date(DATE).unwrap_or_else(SystemTime::now);
            Some(until.duration_since(now).unwrap_or_default())
        })
    }

    /// The date in this header field.
    fn date(&self, name: HeaderName) -> Option<SystemTime> {
        httpdate::parse_http_date(self.headers.get(name)?.to_str().ok()?).ok()
    }

    /// The number in this header field.
    fn number(&self, name: &str) -> Option<u64> {
        self.headers.get(name)?.to_str().ok()?.parse().ok()
    }

    /// What the header fields say of the session.
    pub fn standing(&self) -> Standing {
        let draining = self.headers.get(DRAINING);
        Standing {
            checkpoint: self.number(CHECKPOINT),
            draining: draining.is_some_and(|value| value == "true"),
        }
    }

    /// Whether the same request may succeed later, according to the service or a proxy.
    fn is_temporary(&self) -> bool {
        match self.status.as_u16() {
            408 | 429 | 502 | 503 | 504 => true,
            409 => self.problem().kind() == "not-in-order",
            _ => false,
        }
    }
}

/// How a session or a client reaches the service.
#[derive(Debug, Clone)]
pub struct Transport {
    pub carrier: Carrier,
    /// The addresses of the service, at least one.
    pub addresses: Arc<[Url]>,
    /// The index of the address in use.
    pub used: usize,
    pub authorization: Option<HeaderValue>,
    /// The longest time for one request.
    pub timeout: Duration,
    /// For how long a request is sent again.
    pub retry_for: Duration,
}

impl Transport {
    /// Changes to the next address, if there are several.
    pub fn next_address(&mut self) {
        self.used = (self.used + 1) % self.addresses.len();
    }

    /// The pauses between the tries of a request.
    pub fn backoff(&self) -> Backoff {
        Backoff::new(self.retry_for, self.carrier.clone())
    }

    /// The answer to a request. Sends the request again after temporary failures, until the time for retries is up.
    pub async fn call(&mut self, request: &Request) -> Result<Reply, ClientError> {
        let mut backoff = self.backoff();
        // A connection that was idle for long may break at its next use, so the first break is tried again at once.
        let mut has_broken = self.retry_for.is_zero();
        loop {
            match self.attempt(request).await {
                Ok(reply) if !reply.is_temporary() => return Ok(reply),
                Ok(reply) => {
                    let problem = reply.problem();
                    if problem.kind() == "not-ready" {
                        self.next_address();
                    }
                    if !backoff.wait(problem.retry_after).await {
                        return Err(ClientError::Unavailable(Box::new(problem)));
                    }
                }
                Err(error) if is_final(&error) => return Err(error.into()),
                Err(_) if !has_broken => has_broken = true,
                Err(error) => {
                    self.next_address();
                    if !backoff.wait(None).await {
                        return Err(error.into());
                    }
                }
            }
        }
    }

    /// Sends a request once.
    pub async fn attempt(&self, request: &Request) -> Result<Reply, reqwest::Error> {
        let mut url = self.addresses[self.used].clone();
        url.set_path(&format!(
            "{}{}",
            url.path().trim_end_matches('/'),
            request.path
        ));
        if !request.query.is_empty() {
            url.query_pairs_mut().extend_pairs(&request.query);
        }
        let mut sent = self.carrier.http().request(request.method.clone(), url);
        let more = match self.carrier {
            Carrier::Connections(_) => request.body.time(),
            // A simulated network needs no time for the body.
            Carrier::Network(..) => Duration::ZERO,
        };
        sent = sent.timeout(self.timeout.saturating_add(more));
        if let Some(authorization) = &self.authorization {
            sent = sent.header(AUTHORIZATION, authorization);
        }
        sent = match &request.body {
            Body::Empty => sent,
            Body::Bytes(media_type, bytes) => {
                sent.header(CONTENT_TYPE, *media_type).body(bytes.clone())
            }
            Body::Frames(frames) => sent.multipart(form(frames)),
        };
        let answer = self.carrier.send(sent.build()?).await?;
        Ok(Reply {
            status: answer.status(),
            headers: answer.headers().clone(),
            body: answer.bytes().await?,
        })
    }
}

/// Whether another try cannot succeed: the request is invalid, a certificate is refused, or reqwest has no feature for
/// HTTPS. The last two can be recognised only by their text.
fn is_final(error: &reqwest::Error) -> bool {
    let is_told =
        |text: &String| text.contains("certificate") || text.contains("scheme is not http");
    error.is_builder() || (error.is_connect() && causes(error).iter().any(is_told))
}

fn form(frames: &[Bytes]) -> Form {
    frames.iter().fold(Form::new(), |form, frame| {
        let length = frame.len() as u64;
        let part = Part::stream_with_length(frame.clone(), length);
        form.part("frame", part.file_name("frame"))
    })
}
