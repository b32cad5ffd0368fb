//! What a connection holds until it ends, whoever serves it: HTTP first, then perhaps a stream that takes it over.

use super::activity::Activity;
use super::connection_io::ConnectionIo;
use super::connections::ConnectionPermit;
use axum::body::Body;
use hyper::body::Incoming;
use hyper::server::conn::http1::UpgradeableConnection;
use hyper::service::HttpService;
use hyper_util::rt::TokioIo;
use std::error::Error;
use std::pin::pin;
use std::sync::Arc;
use tokio::sync::watch;

/// A connection's place among the open ones, and how it learns that it is to end. Clones are the same connection.
#[derive(Debug, Clone)]
pub struct ConnectionHold {
    permit: Arc<ConnectionPermit>,
    ending: watch::Receiver<bool>,
    cut_off: watch::Receiver<()>,
}

impl ConnectionHold {
    /// For a connection that ends in order when `ending` turns true, and at once when `cut_off` loses its sender.
    pub fn new(
        permit: ConnectionPermit,
        ending: watch::Receiver<bool>,
        cut_off: watch::Receiver<()>,
    ) -> Self {
        Self {
            permit: Arc::new(permit),
            ending,
            cut_off,
        }
    }

    /// What the connection is doing.
    pub fn activity(&self) -> &Arc<Activity> {
        &self.permit.activity
    }

    /// Waits until the service asks its connections to end.
    pub async fn ending(&mut self) {
        // Without its sender the service is gone.
        let _ = self.ending.wait_for(|ending| *ending).await;
    }

    /// Waits until the connection is cut off.
    pub async fn cut_off(&mut self) {
        while self.cut_off.changed().await.is_ok() {}
    }

    /// What comes of `beginning`, unless the connection has to end before that.
    pub async fn begin<T>(&mut self, beginning: impl Future<Output = T>) -> Option<T> {
        let activity = self.activity().clone();
        let mut cut_off = self.clone();
        tokio::select! {
            biased;
            () = cut_off.cut_off() => None,
            () = self.ending() => None,
            () = activity.shed.notified() => None,
            begun = beginning => Some(begun),
        }
    }

    /// Serves HTTP until the connection ends, or a stream has taken it over.
    pub async fn serve<S>(mut self, connection: UpgradeableConnection<TokioIo<ConnectionIo>, S>)
    where
        S: HttpService<Incoming, ResBody = Body>,
        S::Error: Into<Box<dyn Error + Send + Sync>>,
    {
        let activity = self.activity().clone();
        let mut connection = pin!(connection);
        let mut cut_off = self.clone();
        let mut asked = false;
        loop {
            tokio::select! {
                biased;
                () = cut_off.cut_off() => return tracing::warn!("connection cut off"),
                () = self.ending(), if !asked => {
                    asked = true;
                    connection.as_mut().graceful_shutdown();
                }
                () = activity.shed.notified() => {
                    return tracing::debug!("idle connection closed for another");
                }
                result = &mut connection => {
                    if let Err(error) = result {
                        tracing::debug!(%error, "connection ended");
                    }
                    return;
                }
            }
        }
    }
}
