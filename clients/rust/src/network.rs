//! How requests are carried: by HTTP connections, or by a simulated network.

use reqwest::{Request, Response};
use std::fmt;
use std::pin::Pin;
use std::sync::Arc;
use uuid::Uuid;

/// A simulated network, which also gives the client's random numbers, so that a run can be repeated.
pub trait Network: fmt::Debug + Send + Sync {
    /// The answer to a request, within [its time](Request::timeout). If the connection breaks, reading the body fails.
    fn send(&self, request: Request) -> Pin<Box<dyn Future<Output = Response> + Send + '_>>;

    /// A uniform random number.
    fn random(&self) -> u128;
}

/// Carries requests.
#[derive(Debug, Clone)]
pub enum Carrier {
    Connections(reqwest::Client),
    Network(Arc<dyn Network>, reqwest::Client),
}

impl Carrier {
    /// The HTTP client, which builds requests in both cases.
    pub fn http(&self) -> &reqwest::Client {
        match self {
            Self::Connections(http) | Self::Network(_, http) => http,
        }
    }

    pub async fn send(&self, request: Request) -> Result<Response, reqwest::Error> {
        match self {
            Self::Connections(http) => http.execute(request).await,
            Self::Network(network, _) => Ok(network.send(request).await),
        }
    }

    /// A new id of a session.
    pub fn new_id(&self) -> Uuid {
        match self {
            Self::Connections(_) => Uuid::new_v4(),
            Self::Network(network, _) => {
                uuid::Builder::from_random_bytes(network.random().to_be_bytes()).into_uuid()
            }
        }
    }

    /// A random number from 0 to 1.
    pub fn fraction(&self) -> f64 {
        match self {
            Self::Connections(_) => rand::random(),
            Self::Network(network, _) => network.random() as f64 / u128::MAX as f64,
        }
    }
}
