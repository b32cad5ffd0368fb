//! The service over a real socket, with a real client.

mod access;
mod bag;
mod base_path;
mod binary;
mod blocked;
mod bombs;
mod capacity;
mod compressed;
mod connections;
mod containers;
mod counted;
mod drawn;
mod expiry;
#[cfg(feature = "otel")]
mod export;
mod flow;
mod footage;
mod forged;
mod forms;
mod heavy;
mod hostile_connections;
#[cfg(feature = "tls")]
mod https;
mod idempotency;
mod identity;
#[cfg(feature = "jwt")]
mod identity_provider;
mod labels;
mod lines;
mod log;
mod manners;
mod metrics;
mod mistakes;
mod multer;
mod openapi;
mod openapi_examples;
mod origins;
mod page;
mod problem_page;
mod problems;
mod process;
mod propagation;
mod provoke;
mod quotas;
mod raw;
mod replay;
mod second_opinion;
mod shares;
mod short_flags;
mod slow_line;
mod snapshots;
mod stateless;
mod stream;
mod stream_memory;
mod targets;
mod targets_carried;
mod track_video;
mod uploads;
mod version;
mod videos;

use bagtrack_testing::service::{application, pictures, program, stream_client};
