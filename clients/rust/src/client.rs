//! A service, where sessions are opened.

use crate::error::ClientError;
use crate::network::{Carrier, Network};
use crate::options::{OpenOptions, Targets};
use crate::remote::Remote;
use crate::session::Session;
use crate::transport::{Query, Transport};
use crate::upload::Origin;
use bagtrack_api::media_types::{FRAME, SNAPSHOT};
use bytes::Bytes;
use reqwest::header::HeaderValue;
use reqwest::{IntoUrl, Url};
use std::sync::Arc;
use std::time::Duration;

/// A bagtrack service. A copy shares the connections.
#[derive(Debug, Clone)]
pub struct Client {
    transport: Transport,
    snapshot_every: u32,
}

impl Client {
    /// The service at this address, with its base path where it has one.
    ///
    /// # Errors
    /// It is no address.
    pub fn new(url: impl IntoUrl) -> Result<Self, ClientError> {
        Self::builder(url).build()
    }

    /// A client with other settings.
    pub fn builder(url: impl IntoUrl) -> ClientBuilder {
        ClientBuilder {
            addresses: vec![url.into_url()],
            key: None,
            http: None,
            network: None,
            timeout: Duration::from_secs(15),
            retry_for: Duration::from_secs(60),
            snapshot_every: 30,
        }
    }

    /// Opens a session with its first frame (the bytes of a JPEG, PNG or WebP file) and the targets' boxes in it.
    ///
    /// The client makes the session's id, so that asking twice opens one session.
    ///
    /// # Errors
    /// The service refuses the frame, a box or an option, or gives no answer.
    pub async fn open(
        &self,
        frame: impl Into<Bytes>,
        targets: impl Into<Targets>,
        options: &OpenOptions,
    ) -> Result<Session, ClientError> {
        let query = options.query(&targets.into());
        self.create(query, FRAME, frame.into()).await
    }

    /// Opens a session that goes on where a snapshot was taken, here or at another service with the same keys.
    ///
    /// # Errors
    /// The service refuses the snapshot, or gives no answer.
    pub async fn restore(&self, snapshot: impl Into<Bytes>) -> Result<Session, ClientError> {
        self.create(Query::new(), SNAPSHOT, snapshot.into()).await
    }

    async fn create(
        &self,
        query: Query,
        media_type: &'static str,
        body: Bytes,
    ) -> Result<Session, ClientError> {
        let origin = Origin {
            frame: 0,
            query,
            media_type,
            body,
        };
        let remote = Remote::open(self.transport.clone(), origin, self.snapshot_every).await?;
        Ok(Session::new(remote))
    }
}

/// The settings of a [`Client`].
#[derive(Debug)]
#[must_use]
pub struct ClientBuilder {
    addresses: Vec<Result<Url, reqwest::Error>>,
    key: Option<Key>,
    http: Option<reqwest::Client>,
    network: Option<Arc<dyn Network>>,
    timeout: Duration,
    retry_for: Duration,
    snapshot_every: u32,
}

/// A header with an API key, where that can be one. It is not shown.
type Key = Result<HeaderValue, ClientError>;

impl ClientBuilder {
    /// An API key, or a session token, which is sent with every request.
    pub fn api_key(mut self, key: &str) -> Self {
        // Files with a key end with a line break.
        let key = Some(key.trim()).filter(|key| !key.is_empty());
        let header = key.and_then(|key| HeaderValue::from_str(&format!("Bearer {key}")).ok());
        let header = header.map(|mut value| {
            value.set_sensitive(true);
            value
        });
        self.key = Some(header.ok_or(ClientError::InvalidKey));
        self
    }

    /// Another address where a session may go on, when the one in use gives no answer or is about to end.
    pub fn or_at(mut self, url: impl IntoUrl) -> Self {
        self.addresses.push(url.into_url());
        self
    }

    /// The longest time for one request (15 s); a millisecond more for 50 bytes of its frames, which take long over a
    /// slow line.
    pub fn timeout(mut self, timeout: Duration) -> Self {
        self.timeout = timeout;
        self
    }

    /// For how long a request is sent again after a broken line, 408, 429, 502, 503 or 504 (60 s). With zero no request
    /// is sent again; but a session that the service has lost is opened again, once.
    pub fn retry_for(mut self, time: Duration) -> Self {
        self.retry_for = time;
        self
    }

    /// After so many frames a session takes a snapshot (30; more than 128 count as 128), and keeps the frames after it.
    /// Zero: never, so that a session ends with the service, unless that drains first. A service with a store needs
    /// none, and none are taken.
    pub fn snapshot_every(mut self, frames: u32) -> Self {
        self.snapshot_every = frames;
        self
    }

    /// What requests are sent with: for proxies, certificates, or other numbers of connections.
    pub fn http(mut self, http: reqwest::Client) -> Self {
        self.http = Some(http);
        self
    }

    /// What carries requests in place of connections, in a simulation.
    pub fn network(mut self, network: Arc<dyn Network>) -> Self {
        self.network = Some(network);
        self
    }

    /// The client.
    ///
    /// # Errors
    /// An address is none, or the API key cannot be one.
    pub fn build(self) -> Result<Client, ClientError> {
        let addresses: Result<Vec<Url>, _> = self.addresses.into_iter().collect();
        let http = self
            .http
            .map_or_else(|| reqwest::Client::builder().build(), Ok);
        let carrier = match self.network {
            None => Carrier::Connections(http?),
            Some(network) => Carrier::Network(network, http?),
        };
        let transport = Transport {
            carrier,
            addresses: addresses?.into(),
            used: 0,
            authorization: self.key.transpose()?,
            timeout: self.timeout,
            retry_for: self.retry_for,
        };
        Ok(Client {
            transport,
            snapshot_every: self.snapshot_every,
        })
    }
}
