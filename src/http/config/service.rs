//! Every setting of the service, with its default and its range. With the feature `cli` also with its flag and its
//! environment variable, which only the program reads.

use super::access::AccessConfig;
use super::limits::LimitsConfig;
use super::store::StoreConfig;
#[cfg(feature = "tls")]
use super::tls::TlsConfig;
use crate::http::config::base_path::BasePath;
use std::net::{Ipv4Addr, SocketAddr};
use std::num::NonZeroUsize;
use std::time::Duration;

use super::flag_values::{parse_duration, parse_listen};

use super::limits::shown;

/// What a session with usual parameters is charged at most.
const USUAL_SESSION_BYTES: usize = 512 << 10;

/// The settings of the service. Durations are written like `10m`, `30s`, `500ms`; a number alone is seconds.
#[derive(Debug, Clone, clap::Args)]
pub struct Config {
    /// Address to listen on, or a host's name with a port; port 0 picks a free one.
    #[arg(
        long, env = "BAGTRACK_LISTEN", default_value_t = Config::default().listen, value_parser = parse_listen
    )]
    pub listen: SocketAddr,
    /// The certificate that clients see.
    #[cfg(feature = "tls")]
    #[command(flatten)]
    pub tls: TlsConfig,
    /// Frames decoded and tracked at the same time [default: the number of cores].
    #[arg(long, env = "BAGTRACK_WORKERS")]
    pub workers: Option<usize>,
    /// Requests with a frame that are inside at the same time, the ones at work included.
    #[arg(long, env = "BAGTRACK_QUEUE", default_value_t = Config::default().queue)]
    pub queue: usize,
    /// Most sessions alive.
    #[arg(
        long, env = "BAGTRACK_MAX_SESSIONS",
        default_value_t = Config::default().max_sessions
    )]
    pub max_sessions: usize,
    /// Requests at one session at the same time, the one at work included.
    #[arg(
        long, env = "BAGTRACK_SESSION_QUEUE",
        default_value_t = Config::default().session_queue
    )]
    pub session_queue: usize,
    /// A session expires when no frame comes for this long.
    #[arg(
        long, env = "BAGTRACK_SESSION_IDLE",
        default_value = shown(Config::default().session_idle),
        value_parser = parse_duration
    )]
    pub session_idle: Duration,
    /// A new session expires when its first frame does not come for this long.
    #[arg(
        long, env = "BAGTRACK_SESSION_FIRST",
        default_value = shown(Config::default().session_first),
        value_parser = parse_duration
    )]
    pub session_first: Duration,
    /// Most bytes of a request body.
    #[arg(
        long, env = "BAGTRACK_MAX_BODY_BYTES",
        default_value_t = Config::default().max_body_bytes
    )]
    pub max_body_bytes: usize,
    /// Most bytes of all bodies together: of what has come of requests, and of large answers that are not taken yet.
    #[arg(
        long, env = "BAGTRACK_MAX_UPLOAD_BYTES",
        default_value_t = Config::default().max_upload_bytes
    )]
    pub max_upload_bytes: usize,
    /// Most frames of one post.
    #[arg(
        long, env = "BAGTRACK_MAX_FRAMES",
        default_value_t = Config::default().max_frames
    )]
    pub max_frames: usize,
    /// Most bytes of one encoded frame.
    #[arg(
        long, env = "BAGTRACK_MAX_FRAME_BYTES",
        default_value_t = Config::default().max_frame_bytes
    )]
    pub max_frame_bytes: usize,
    /// Longest side of a frame in pixels.
    #[arg(
        long, env = "BAGTRACK_MAX_FRAME_SIDE",
        default_value_t = Config::default().max_frame_side
    )]
    pub max_frame_side: u32,
    /// Most pixels of a frame.
    #[arg(
        long, env = "BAGTRACK_MAX_FRAME_PIXELS",
        default_value_t = Config::default().max_frame_pixels
    )]
    pub max_frame_pixels: u64,
    /// Most memory in bytes that decoding one frame may take.
    #[arg(
        long, env = "BAGTRACK_MAX_FRAME_MEMORY",
        default_value_t = Config::default().max_frame_memory
    )]
    pub max_frame_memory: u64,
    /// Most connections open at the same time.
    #[arg(
        long, env = "BAGTRACK_MAX_CONNECTIONS",
        default_value_t = Config::default().max_connections
    )]
    pub max_connections: usize,
    /// Origins of web pages that may use the service from elsewhere, like `https://example.org`, separated by
    /// commas; `*` for all. Requests of other pages are refused.
    #[arg(long, env = "BAGTRACK_CORS_ORIGINS", value_delimiter = ',')]
    pub cors_origins: Vec<String>,
    /// The path of the service on a host that it shares with others, like `/tracker`.
    #[arg(
        long, env = "BAGTRACK_BASE_PATH", value_name = "PATH",
        default_value_t = Config::default().base_path
    )]
    pub base_path: BasePath,
    /// Time for a client to send its request head, and for its TLS handshake before; a connection that is idle for
    /// longer is closed too.
    #[arg(
        long, env = "BAGTRACK_HEADER_TIMEOUT",
        default_value = shown(Config::default().header_timeout),
        value_parser = parse_duration
    )]
    pub header_timeout: Duration,
    /// Time for a client to send its request body.
    #[arg(
        long, env = "BAGTRACK_BODY_TIMEOUT",
        default_value = shown(Config::default().body_timeout),
        value_parser = parse_duration
    )]
    pub body_timeout: Duration,
    /// Time for a request to wait for its session and a worker and to be worked on.
    #[arg(
        long, env = "BAGTRACK_WORK_TIMEOUT",
        default_value = shown(Config::default().work_timeout),
        value_parser = parse_duration
    )]
    pub work_timeout: Duration,
    /// On SIGTERM, /readyz answers 503 and no session can be opened for this long before connections are refused, so
    /// that load balancers notice, and clients take their sessions elsewhere. SIGINT leaves it out.
    #[arg(
        long, env = "BAGTRACK_SHUTDOWN_DELAY",
        default_value = shown(Config::default().shutdown_delay),
        value_parser = parse_duration
    )]
    pub shutdown_delay: Duration,
    /// Time for open requests to end on shutdown.
    #[arg(
        long, env = "BAGTRACK_SHUTDOWN_TIMEOUT",
        default_value = shown(Config::default().shutdown_timeout),
        value_parser = parse_duration
    )]
    pub shutdown_timeout: Duration,
    /// What one request and one client may take.
    #[command(flatten)]
    pub limits: LimitsConfig,
    /// The store that replicas share.
    #[command(flatten)]
    pub store: StoreConfig,
    /// Who may use the service.
    #[command(flatten)]
    pub access: AccessConfig,
}

impl Default for Config {
    /// The settings that hold where no other is given. Neither flags nor the environment are read.
    fn default() -> Self {
        let limits = bagtrack_ingest::Limits::default();
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)),
            #[cfg(feature = "tls")]
            tls: TlsConfig::default(),
            workers: None,
            queue: 256,
            max_sessions: 1024,
            session_queue: 8,
            session_idle: Duration::from_secs(600),
            session_first: Duration::from_secs(60),
            max_body_bytes: 32 << 20,
            max_upload_bytes: 512 << 20,
            max_frames: 64,
            max_frame_bytes: limits.max_bytes,
            max_frame_side: limits.max_side,
            max_frame_pixels: limits.max_pixels,
            max_frame_memory: limits.max_memory,
            max_connections: 4096,
            cors_origins: Vec::new(),
            base_path: BasePath::default(),
            header_timeout: Duration::from_secs(30),
            body_timeout: Duration::from_secs(30),
            work_timeout: Duration::from_secs(30),
            shutdown_delay: Duration::from_secs(5),
            shutdown_timeout: Duration::from_secs(20),
            limits: LimitsConfig::default(),
            store: StoreConfig::default(),
            access: AccessConfig::default(),
        }
    }
}

impl Config {
    /// The number of workers, with its default.
    pub fn worker_count(&self) -> usize {
        self.workers.unwrap_or_else(cores)
    }

    /// The number of threads that serve connections. Reading and answering a request takes them about a tenth of the
    /// time that its frame takes a worker, and fewer threads are woken less often.
    pub fn network_threads(&self) -> usize {
        self.worker_count().div_ceil(8).clamp(1, cores())
    }

    /// The limits of one frame.
    pub fn frame_limits(&self) -> bagtrack_ingest::Limits {
        bagtrack_ingest::Limits {
            max_bytes: self.max_frame_bytes,
            max_side: self.max_frame_side,
            max_pixels: self.max_frame_pixels,
            max_memory: self.max_frame_memory,
        }
    }

    /// Most bytes that the states of all sessions may take together, with its default.
    pub fn session_bytes(&self) -> usize {
        let default = self.max_sessions.saturating_mul(USUAL_SESSION_BYTES);
        self.limits.max_session_bytes.unwrap_or(default)
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Set for the process that [`the_defaults_do_not_come_from_the_environment`] starts.
    const CHILD: &str = "BAGTRACK_TEST_CHILD";

    #[test]
    fn the_defaults_do_not_come_from_the_environment() {
        if std::env::var_os(CHILD).is_some() {
            let defaults = Config::default();
            assert_eq!((defaults.queue, defaults.workers), (256, None));
            println!("the defaults are as they should be");
            return;
        }
        // Another process, since the environment of this one cannot be changed while other tests run.
        let tests = std::env::current_exe().unwrap();
        let mut command = std::process::Command::new(tests);
        command.args([
            "the_defaults_do_not_come_from_the_environment",
            "--nocapture",
        ]);
        command.env(CHILD, "1");
        command.env("BAGTRACK_WORKERS", "3");
        command.env("BAGTRACK_QUEUE", "no number");
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{output:?}");
        assert!(
            said.contains("the defaults are as they should be"),
            "{said}"
        );
    }
}
