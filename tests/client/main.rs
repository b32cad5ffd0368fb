//! The Rust client, against real services over real sockets.

mod broken_lines;
mod clip;
mod following;
mod lost_sessions;
mod refusals;

use bagtrack_testing::pictures;
use bagtrack_testing::service::{application, lossy, replica};
