//! Several replicas of the program, and a Redis that they share; or one, with a folder.

mod addresses;
mod balancers;
mod broken_off;
mod chaos;
mod clip;
mod failures;
mod folder;
mod forwarding;
mod incarnations;
mod lost_records;
mod pair;
mod prefix;
mod refusing;
mod shares;
mod sharing;
mod streams;
mod tracking_client;
mod tracks;
mod trouble;
mod upgrade;

use bagtrack_testing::processes;
use bagtrack_testing::service::{lossy, replica, stream_client};
