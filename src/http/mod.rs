//! The HTTP interface: one file for each resource, and the layers that every request passes through.
//!
//! In: connections. Out: JSON answers, or problem documents (RFC 9457). A request goes through the layers of the
//! router, into an extractor that reads its upload, into its handler, which works on a session with a worker thread,
//! and back.
//!
//! What can go wrong: clients send headers or bodies slowly, or too much of them; bytes are not an image; there is more
//! work than there are cores; a connection breaks after a frame was taken; a client has no key. [`Application`] bounds
//! the first, [`Config`] names every bound, numbered frames can be sent again, the room `auth` says who may call, and the
//! cause of an error is in the log only.
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

mod accept;
mod activity;
mod advance;
mod advance_session;
mod answer;
mod answer_problems;
mod api;
mod auth;
mod bag_picture;
mod base_path;
mod box_check;
mod client;
mod clients;
mod config;
mod config_validation;
mod connection_hold;
mod connection_io;
mod connections;
mod cors;
mod create;
mod create_named;
mod create_request;
mod cvat;
mod docs;
mod drain;
mod draining;
mod drawn;
mod durability;
#[cfg(feature = "otel")]
mod exported_span;
mod first_frame;
#[cfg(feature = "cli")]
mod flag_values;
mod forwarded;
mod frame_order;
mod frames;
mod head_problems;
mod health;
mod host;
mod idempotency;
mod identify;
mod json;
mod least_rate;
mod limits_config;
mod lines;
mod memory_bound;
mod metrics;
mod newest;
mod open_once;
mod openapi;
mod opening;
mod page;
mod problems;
mod request_id;
mod request_log;
mod router;
#[cfg(feature = "eval")]
mod sample_clips;
mod saturation;
mod security_headers;
mod server;
mod session;
mod session_path;
mod snapshot;
mod state;
mod static_file;
mod store_config;
mod stored;
mod stored_writes;
mod stream;
mod target;
mod target_box;
mod target_boxes;
mod token;
mod trace_context;
mod track;
mod track_video;
mod upload;
mod version;
mod video_frames;
mod video_place;
mod work;

pub use auth::access::AccessError;
pub use auth::config::{AccessConfig, Secret};
pub use auth::keys::{ApiKeys, KeysError};
pub use base_path::{BasePath, BasePathError};
pub use client::Client;
pub use config::Config;
pub use config_validation::ConfigError;
#[cfg(feature = "cli")]
pub use flag_values::{parse_duration, parse_listen};
pub use limits_config::LimitsConfig;
pub use memory_bound::MemoryBound;
pub use openapi::document::document as openapi_document;
pub use problems::kind::Kind as ProblemKind;
pub use server::{Application, BindError, Shutdown};
pub use snapshot::MEDIA_TYPE as SNAPSHOT_MEDIA_TYPE;
pub use store_config::{StoreConfig, StoreMode};
