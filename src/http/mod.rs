//! The HTTP interface: one file a resource, and around them what every request passes through.
//!
//! What could go wrong: clients that send headers or bodies slowly, or too much of them; bytes that are no
//! image; more work than there are cores; a connection that breaks after a frame was taken. [`Application`]
//! bounds the first, [`Config`] names every bound, and every error is a problem document whose cause stays in
//! the log.
//!
//! ```no_run
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! use bagtrack::http::{Application, Config};
//!
//! let application = Application::bind(Config::default()).await?;
//! println!("listening on http://{}", application.local_addr()?);
//! application.serve(std::future::pending()).await;
//! # Ok(())
//! # }
//! ```

mod advance;
mod answer;
mod answer_problems;
mod api;
mod config;
mod create;
mod docs;
mod drain;
mod frames;
mod health;
mod openapi;
mod page;
mod problems;
mod request_id;
mod router;
mod server;
mod session;
mod session_path;
mod snapshot;
mod state;
mod target;
mod target_box;
mod upload;
mod work;

pub use config::{Config, ConfigError};
pub use api::document as openapi_document;
pub use problems::kind::Kind as ProblemKind;
pub use server::{Application, BindError};
pub use snapshot::MEDIA_TYPE as SNAPSHOT_MEDIA_TYPE;
