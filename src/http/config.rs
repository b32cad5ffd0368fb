//! Every setting of the service, with its flag, its variable and its range.

use crate::ingest;
use clap::Parser;
use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::time::Duration;

/// The settings of the service. Durations are written like `10m`, `30s`, `500ms`.
#[derive(Debug, Clone, clap::Args)]
pub struct Config {
    /// Address to listen on; port 0 picks a free one.
    #[arg(long, env = "BAGTRACK_LISTEN", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
    /// Frames decoded and tracked at the same time [default: the number of cores].
    #[arg(long, env = "BAGTRACK_WORKERS")]
    pub workers: Option<usize>,
    /// Requests with a frame that are inside at the same time, the ones at work included.
    #[arg(long, env = "BAGTRACK_QUEUE", default_value_t = 256)]
    pub queue: usize,
    /// Most sessions alive.
    #[arg(long, env = "BAGTRACK_MAX_SESSIONS", default_value_t = 1024)]
    pub max_sessions: usize,
    /// Requests at one session at the same time, the one at work included.
    #[arg(long, env = "BAGTRACK_SESSION_QUEUE", default_value_t = 8)]
    pub session_queue: usize,
    /// A session that is not used for this long expires.
    #[arg(long, env = "BAGTRACK_SESSION_IDLE", default_value = "10m", value_parser = humantime::parse_duration)]
    pub session_idle: Duration,
    /// Most bytes of a request body.
    #[arg(long, env = "BAGTRACK_MAX_BODY_BYTES", default_value_t = 32 << 20)]
    pub max_body_bytes: usize,
    /// Most bytes of all request bodies together; one of unknown length counts as the largest.
    #[arg(long, env = "BAGTRACK_MAX_UPLOAD_BYTES", default_value_t = 512 << 20)]
    pub max_upload_bytes: usize,
    /// Most frames of one post.
    #[arg(long, env = "BAGTRACK_MAX_FRAMES", default_value_t = 64)]
    pub max_frames: usize,
    /// Most bytes of one encoded frame.
    #[arg(long, env = "BAGTRACK_MAX_FRAME_BYTES", default_value_t = ingest::Limits::default().max_bytes)]
    pub max_frame_bytes: usize,
    /// Longest side of a frame in pixels.
    #[arg(long, env = "BAGTRACK_MAX_FRAME_SIDE", default_value_t = ingest::Limits::default().max_side)]
    pub max_frame_side: u32,
    /// Most pixels of a frame.
    #[arg(long, env = "BAGTRACK_MAX_FRAME_PIXELS", default_value_t = ingest::Limits::default().max_pixels)]
    pub max_frame_pixels: u64,
    /// Most memory in bytes that decoding one frame may take.
    #[arg(long, env = "BAGTRACK_MAX_FRAME_MEMORY", default_value_t = ingest::Limits::default().max_memory)]
    pub max_frame_memory: u64,
    /// Most connections open at the same time.
    #[arg(long, env = "BAGTRACK_MAX_CONNECTIONS", default_value_t = 4096)]
    pub max_connections: usize,
    /// Origins of web pages that may use the service from elsewhere, like `https://example.org`, separated by
    /// commas; `*` for all.
    #[arg(long, env = "BAGTRACK_CORS_ORIGINS", value_delimiter = ',')]
    pub cors_origins: Vec<String>,
    /// Time for a client to send its request head; a connection that is idle for longer is closed too.
    #[arg(long, env = "BAGTRACK_HEADER_TIMEOUT", default_value = "30s", value_parser = humantime::parse_duration)]
    pub header_timeout: Duration,
    /// Time for a client to send its request body.
    #[arg(long, env = "BAGTRACK_BODY_TIMEOUT", default_value = "30s", value_parser = humantime::parse_duration)]
    pub body_timeout: Duration,
    /// Time for a request to wait for its session and a worker and to be worked on.
    #[arg(long, env = "BAGTRACK_WORK_TIMEOUT", default_value = "30s", value_parser = humantime::parse_duration)]
    pub work_timeout: Duration,
    /// On SIGTERM, /readyz answers 503 for this long before connections are refused, so that a load
    /// balancer notices.
    #[arg(long, env = "BAGTRACK_SHUTDOWN_DELAY", default_value = "0s", value_parser = humantime::parse_duration)]
    pub shutdown_delay: Duration,
    /// Time for open requests to end on shutdown.
    #[arg(long, env = "BAGTRACK_SHUTDOWN_TIMEOUT", default_value = "20s", value_parser = humantime::parse_duration)]
    pub shutdown_timeout: Duration,
}

/// A setting out of its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--{flag} (BAGTRACK_{variable}) must be {expected}")]
pub struct ConfigError {
    flag: &'static str,
    variable: String,
    expected: &'static str,
}

#[derive(Parser)]
struct Defaults {
    #[command(flatten)]
    config: Config,
}

impl Default for Config {
    fn default() -> Self {
        Defaults::parse_from(["bagtrack"]).config
    }
}

impl Config {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first setting that is out of its range, by its flag and variable.
    pub fn validate(&self) -> Result<(), ConfigError> {
        // The queue, the connections and the sessions' places are semaphores, which have this limit.
        let semaphore = 1..=tokio::sync::Semaphore::MAX_PERMITS;
        let moment = Duration::from_millis(1)..=Duration::from_secs(365 * 24 * 3600);
        let uploads = self.max_body_bytes..=(4 << 40);
        let is_origin = |text: &String| {
            let host = text.split_once("://").map_or("", |(_, host)| host);
            let plain = host
                .bytes()
                .all(|byte| byte.is_ascii_graphic() && byte != b'/');
            text == "*" || (!host.is_empty() && plain)
        };
        let positive = "at least 1";
        let duration = "between 1ms and 1 year";
        let checks = [
            (
                "workers",
                self.workers.is_none_or(|n| semaphore.contains(&n)),
                positive,
            ),
            ("queue", semaphore.contains(&self.queue), positive),
            ("max-sessions", self.max_sessions >= 1, positive),
            (
                "session-queue",
                semaphore.contains(&self.session_queue),
                positive,
            ),
            (
                "session-idle",
                moment.contains(&self.session_idle),
                duration,
            ),
            ("max-body-bytes", self.max_body_bytes >= 1, positive),
            (
                "max-upload-bytes",
                uploads.contains(&self.max_upload_bytes),
                "at least max-body-bytes, at most 4 TiB",
            ),
            ("max-frames", self.max_frames >= 1, positive),
            ("max-frame-bytes", self.max_frame_bytes >= 1, positive),
            ("max-frame-side", self.max_frame_side >= 1, positive),
            ("max-frame-pixels", self.max_frame_pixels >= 1, positive),
            ("max-frame-memory", self.max_frame_memory >= 1, positive),
            (
                "max-connections",
                semaphore.contains(&self.max_connections),
                positive,
            ),
            (
                "cors-origins",
                self.cors_origins.iter().all(is_origin),
                "origins like https://example.org, or *",
            ),
            (
                "header-timeout",
                moment.contains(&self.header_timeout),
                duration,
            ),
            (
                "body-timeout",
                moment.contains(&self.body_timeout),
                duration,
            ),
            (
                "work-timeout",
                moment.contains(&self.work_timeout),
                duration,
            ),
            (
                "shutdown-delay",
                self.shutdown_delay <= *moment.end(),
                "at most 1 year",
            ),
            (
                "shutdown-timeout",
                self.shutdown_timeout <= *moment.end(),
                "at most 1 year",
            ),
        ];
        match checks.into_iter().find(|(_, holds, _)| !holds) {
            None => Ok(()),
            Some((flag, _, expected)) => Err(ConfigError {
                flag,
                variable: flag.to_uppercase().replace('-', "_"),
                expected,
            }),
        }
    }

    /// The number of workers, with its default.
    pub fn worker_count(&self) -> usize {
        self.workers.unwrap_or_else(cores)
    }

    /// The number of threads that serve connections. Reading and answering a request takes a tenth of the time that its
    /// frame takes a worker; and with fewer threads there are fewer to wake for it.
    pub fn network_threads(&self) -> usize {
        self.worker_count().div_ceil(8).clamp(1, cores())
    }

    /// What a frame may cost.
    pub fn frame_limits(&self) -> ingest::Limits {
        ingest::Limits {
            max_bytes: self.max_frame_bytes,
            max_side: self.max_frame_side,
            max_pixels: self.max_frame_pixels,
            max_memory: self.max_frame_memory,
        }
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(Config::default().validate(), Ok(()));
    }

    #[test]
    fn a_setting_out_of_range_is_named() {
        let config = Config {
            max_frames: 0,
            ..Config::default()
        };
        let message = config.validate().unwrap_err().to_string();
        assert_eq!(
            message,
            "--max-frames (BAGTRACK_MAX_FRAMES) must be at least 1"
        );
    }
}
