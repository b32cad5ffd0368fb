//! The HTTP interface: one file for each resource, and the middleware that every request passes through.
//!
//! In: connections. Out: JSON answers, or problem documents (RFC 9457). A request goes through the layers of the
//! router, into an extractor that reads its upload, and into its handler, which has a worker thread work on a session.
//! The answer goes back through the layers.
//!
//! What can go wrong: clients send headers or bodies slowly, or too much of them, or more work than the cores can do
//! ([`Config`] names a bound for each); a connection breaks after a frame was taken (a numbered frame can be sent
//! again); a client has no key ([`ApiKeys`] say who may call). The cause of an error is in the log only.
//!
//! ```no_run
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! use bagtrack::http::{Application, Config};
//!
//! let application = Application::bind(Config::default()).await?;
//! println!("listening on http://{}", application.local_addr()?);
//! application.serve(std::future::pending::<()>()).await;
//! # Ok(())
//! # }
//! ```

#![warn(clippy::disallowed_methods)]

mod extract;
mod metrics;
mod middleware;
mod page;
mod problems;
mod resources;
mod respond;
mod server;
mod state;
mod stream;

#[cfg(feature = "jwt")]
pub use bagtrack_access::JwtError;
pub use bagtrack_access::{AccessError, ApiKeys, KeysError};
pub use bagtrack_api::ProblemKind;
pub use bagtrack_api::media_types::SNAPSHOT as SNAPSHOT_MEDIA_TYPE;
#[cfg(feature = "jwt")]
pub use bagtrack_config::JwtConfig;
#[cfg(feature = "tls")]
pub use bagtrack_config::TlsConfig;
pub use bagtrack_config::{
    AccessConfig, BasePath, BasePathError, Config, ConfigError, LimitsConfig, MemoryBound, Secret,
    StoreConfig, parse_duration, parse_listen,
};
#[cfg(feature = "tls")]
pub use bagtrack_net::CertificateError;
pub use bagtrack_quotas::Client;
pub use resources::routes::document as openapi_document;
pub use server::application::{Application, BindError, Shutdown};
pub use server::connections::ConnectionService;
pub use server::service::Service;
pub use state::Parts;
