//! The client: opens sessions at a service.

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

/// A bagtrack service. Clones share the connections.
#[derive(Debug, Clone)]
pub struct Client {
    transport: Transport,
    snapshot_every: u32,
}

impl Client {
    /// The service at this address (`http://host:port`, with the base path if it has one).
    ///
    /// # Errors
    /// `url` cannot be parsed.
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
    /// The client makes the session's id, so that a request that is sent twice opens one session.
    ///
    /// # Errors
    /// The service refuses the frame, a box or an option, or does not answer.
    pub async fn open(
        &self,
        frame: impl Into<Bytes>,
        targets: impl Into<Targets>,
        options: &OpenOptions,
    ) -> Result<Session, ClientError> {
        let query = options.query(&targets.into());
        self.create(query, FRAME, frame.into()).await
    }

    /// Opens a session with the state of a snapshot, taken at this service or at one with the same snapshot keys.
    ///
    /// # Errors
    /// The service refuses the snapshot, or does not answer.
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

/// The authorization header for an API key, or why the key cannot be in a header. `Debug` does not show the key.
type Key = Result<HeaderValue, ClientError>;

impl ClientBuilder {
    /// An API key or session token to send with every request. An empty one counts as none.
    pub fn api_key(mut self, key: &str) -> Self {
        // A key read from a file may end with a line break.
        let key = Some(key.trim()).filter(|key| !key.is_empty());
        let header = key.and_then(|key| HeaderValue::from_str(&format!("Bearer {key}")).ok());
        let header = header.map(|mut value| {
            value.set_sensitive(true);
            value
        });
        self.key = Some(header.ok_or(ClientError::InvalidKey));
        self
    }

    /// Another address, where a session goes on if the service at the one in use does not answer, or is about to end.
    pub fn or_at(mut self, url: impl IntoUrl) -> Self {
        self.addresses.push(url.into_url());
        self
    }

    /// The longest time for one request (default: 15 s). Each 50 bytes of frames add a millisecond, for slow
    /// connections.
    pub fn timeout(mut self, timeout: Duration) -> Self {
        self.timeout = timeout;
        self
    }

    /// For how long a request is sent again after a broken connection, 408, 429, 502, 503 or 504 (default: 60 s). With
    /// zero no request is sent again; but a session that the service has lost is opened again, once.
    pub fn retry_for(mut self, time: Duration) -> Self {
        self.retry_for = time;
        self
    }

    /// The number of frames from one snapshot of a session to the next (default: 30; at most 128). The client keeps the
    /// frames since the last one. With zero it takes none, so a session ends with its service, unless that drains
    /// first. From a service with a store it takes none either.
    pub fn snapshot_every(mut self, frames: u32) -> Self {
        self.snapshot_every = frames;
        self
    }

    /// The HTTP client to send requests with: for proxies, certificates, or other numbers of connections.
    pub fn http(mut self, http: reqwest::Client) -> Self {
        self.http = Some(http);
        self
    }

    /// A simulated network, which carries requests instead of connections.
    pub fn network(mut self, network: Arc<dyn Network>) -> Self {
        self.network = Some(network);
        self
    }

    /// Builds the client.
    ///
    /// # Errors
    /// An address cannot be parsed, or the API key has characters that a header cannot have.
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
