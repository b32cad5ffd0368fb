//! A bound of the memory that the service takes, from its settings.

use super::limits::OFF;
use super::service::Config;
use bagtrack_ingest::video::MAX_DECODER_MEMORY;
#[cfg(feature = "tls")]
use bagtrack_net::MAX_UNSENT_BYTES;
use bagtrack_sessions::{MAX_LIST_BYTES, threads_of};
use bagtrack_tracker::MAX_WORKING_SIDE;

/// Most bytes of a buffer of a connection, and so of the head of a request. A stream has its own buffers instead.
pub const MAX_BUFFER_BYTES: usize = 32 << 10;
/// Most buffers of a connection: a request's head, the begun body behind it, the room for more of the body, and the
/// answer's bytes.
const BUFFERS: u64 = 4;
/// Connections besides `max_connections`, for addresses that may have no more of those: they get the answer to a health
/// check, and nothing else.
pub const PROBE_CONNECTIONS: usize = 32;
/// Bytes of the program, its tables, the log's queue, and the allocator's own use.
const PROGRAM: u64 = 96 << 20;
/// Bytes that a worker keeps from frame to frame: buffers of the decoder and the tracker's workspace.
const WORKER: u64 = 64 << 20;
/// The largest working image of a frame that waits for its turn in a request: luma, and chroma in half of its columns
/// and rows.
const WORKING_IMAGE: u64 = MAX_WORKING_SIDE as u64 * MAX_WORKING_SIDE as u64 * 3 / 2;
/// Bytes of a connection's tasks, besides its buffers.
const CONNECTION: u64 = 16 << 10;
/// Bytes that TLS keeps for a connection: those that wait to be sent, an incomplete handshake message, and a record's
/// plain text.
#[cfg(feature = "tls")]
const TLS_CONNECTION: u64 = MAX_UNSENT_BYTES as u64 + (64 << 10) + (32 << 10);

/// Bytes of a store in a folder: written entries that are not in tables yet, and blocks that were read.
const FILE_STORE: u64 = 128 << 20;

/// Most bytes that each part of the service takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryBound {
    /// Bodies of requests, decoded copies and unread answers included.
    pub uploads: u64,
    /// Decoding and tracking.
    pub work: u64,
    /// The states of sessions.
    pub sessions: u64,
    /// Buffers of connections.
    pub connections: u64,
    /// The store in a folder, where there is one.
    pub store: u64,
    /// The processes that decode videos.
    pub videos: u64,
}

impl MemoryBound {
    /// The bound for a service with these settings.
    pub fn of(config: &Config) -> Self {
        let count = |n: usize| n as u64;
        let workers = count(config.worker_count());
        let threads = workers.saturating_add(count(threads_of(config.worker_count())));
        // A body is copied once on its way, from the connection's buffer or out of base64.
        let frame = config.max_frame_memory;
        let frame = frame.max(count(config.max_body_bytes).saturating_mul(2));
        let thread = WORKER + WORKING_IMAGE + count(MAX_LIST_BYTES);
        Self {
            uploads: count(config.max_upload_bytes),
            // There are as many quick workers as slow ones, and each has a frame. Further threads hold work that waits
            // between two of its frames. Each thread keeps buffers, a working image and a copy of its session's
            // targets.
            work: (workers.saturating_mul(2).saturating_mul(frame))
                .saturating_add(threads.saturating_mul(thread)),
            sessions: count(config.session_bytes()),
            connections: count(config.max_connections.saturating_add(PROBE_CONNECTIONS))
                .saturating_mul(connection(config)),
            store: if config.store.is_in_folder() {
                FILE_STORE
            } else {
                0
            },
            videos: match config.limits.ffmpeg.as_str() {
                OFF => 0,
                // Each decoder has its video as a file in memory.
                _ => {
                    let video = MAX_DECODER_MEMORY.saturating_add(count(config.max_body_bytes));
                    count(config.video_places()).saturating_mul(video)
                }
            },
        }
    }

    /// The sum of all parts, with the program itself.
    pub fn total(&self) -> u64 {
        let beside = [
            self.uploads,
            self.work,
            self.sessions,
            self.connections,
            self.videos,
            self.store,
        ];
        beside.into_iter().fold(PROGRAM, u64::saturating_add)
    }
}

fn connection(config: &Config) -> u64 {
    let plain = BUFFERS * MAX_BUFFER_BYTES as u64 + CONNECTION;
    #[cfg(feature = "tls")]
    if config.tls.tls_cert.is_some() {
        return plain + TLS_CONNECTION;
    }
    #[cfg(not(feature = "tls"))]
    let _ = config;
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_grows_with_every_setting_that_it_is_made_of() {
        let config = || Config {
            workers: Some(2),
            ..Config::default()
        };
        let total = |config: &Config| MemoryBound::of(config).total();
        let with = |change: &dyn Fn(&mut Config)| {
            let mut config = config();
            change(&mut config);
            total(&config)
        };
        let before = total(&config());
        assert_eq!(with(&|c| c.max_upload_bytes += 1 << 20), before + (1 << 20));
        assert_eq!(with(&|c| c.max_frame_memory += 1 << 20), before + (4 << 20));
        assert!(with(&|c| c.workers = Some(3)) > before);
        assert!(with(&|c| c.max_sessions += 1) > before);
        assert!(with(&|c| c.max_connections += 1) > before);
        #[cfg(feature = "tls")]
        assert!(with(&|c| c.tls.tls_cert = Some("cert.pem".into())) > before);
    }

    /// An overflow would panic at the start of the service.
    #[test]
    fn the_bound_of_the_largest_settings_is_a_number() {
        let config = Config {
            max_frame_memory: u64::MAX,
            max_upload_bytes: usize::MAX,
            max_body_bytes: usize::MAX,
            ..Config::default()
        };
        assert_eq!(MemoryBound::of(&config).total(), u64::MAX);
    }
}
