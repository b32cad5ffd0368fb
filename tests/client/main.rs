//! The Rust client, against real services over real sockets.

#[allow(dead_code, reason = "the tests of the service use the rest")]
#[path = "../http/application.rs"]
mod application;
mod broken_lines;
mod clip;
mod following;
#[allow(dead_code, reason = "the tests of the replicas use the rest")]
#[path = "../replicas/lossy.rs"]
mod lossy;
mod lost_sessions;
#[allow(dead_code, reason = "the tests of the service use the rest")]
#[path = "../http/pictures.rs"]
mod pictures;
mod refusals;
#[allow(dead_code, reason = "the tests of the replicas use the rest")]
#[path = "../replicas/replica.rs"]
mod replica;
#[allow(dead_code, reason = "the tests of the replicas use the rest")]
#[path = "../replicas/server.rs"]
mod server;
