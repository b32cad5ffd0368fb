//! The service over a real socket, with a real client.

mod contract;
mod helpers;
mod limits;
mod operation;
mod requests;
mod security;
mod sessions;
mod streams;
mod video;

use bagtrack_testing::pictures;
use bagtrack_testing::service::{application, program, stream_client};
