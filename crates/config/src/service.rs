//! Every setting of the service.

use super::access::AccessConfig;
use super::base_path::BasePath;
use super::limits::LimitsConfig;
use super::settings::{
    ConfigError, delay, in_range, moment, origins, permits, positive, settings, threads,
};
use super::store::StoreConfig;
use bagtrack_cli::ModelFiles;
use std::net::{Ipv4Addr, SocketAddr};
use std::num::NonZeroUsize;
#[cfg(feature = "tls")]
use std::path::PathBuf;
use std::time::Duration;

/// Most bytes that a session with usual parameters is charged.
const USUAL_SESSION_BYTES: usize = 512 << 10;

settings! {
    /// The settings of the service. Durations are written like `10m`, `30s`, `500ms`; a number alone is seconds.
    pub struct Config {
        # "Listening"
        /// Address to listen on, or a host's name with a port; port 0 picks a free one.
        listen: SocketAddr = SocketAddr::from((Ipv4Addr::LOCALHOST, 8080));
        /// The path of the service on a host that it shares with others, like `/tracker`.
        base_path: BasePath = BasePath::default();

        # "Work and queues"
        /// Frames decoded and tracked at the same time [default: the number of cores].
        workers: Option<usize> = None, threads;
        /// Requests with a frame that are inside at the same time, the ones at work included.
        queue: usize = 256, permits;
        /// When the oldest frame of a client has waited longer for a worker all the time, for half a second, its newest
        /// go first, and older ones that have waited twice as long are refused. Frames of streams and posts of several
        /// wait. 0s: none is refused.
        queue_delay: Duration = Duration::from_millis(75), delay;
        /// Requests at one session at the same time, the one at work included.
        session_queue: usize = 8, permits;
        /// Time for a request to wait for its session and a worker and to be worked on.
        work_timeout: Duration = Duration::from_secs(30), moment;

        # "Sessions"
        /// Most sessions alive.
        max_sessions: usize = 1024, permits;
        /// A session expires when no frame comes for this long.
        session_idle: Duration = Duration::from_secs(600), moment;
        /// A new session expires when its first frame does not come for this long.
        session_first: Duration = Duration::from_secs(60), moment;
        /// A network that gives a second opinion of every frame of a session: the ONNX files of its backbone and its
        /// head. Sessions that were opened with one go on with the same one alone.
        model: Option<ModelFiles> = None, as "nanotrack:BACKBONE,HEAD";
        /// The network is asked only of frames of which the filter is not sure: with a score below 0.95. All replicas
        /// must have the same.
        model_in_doubt: bool = false;

        # "Uploads"
        /// Most bytes of a request body.
        max_body_bytes: usize = 32 << 20, positive;
        /// Most bytes of all bodies together: of what has come of requests, and of large answers that are not taken
        /// yet.
        max_upload_bytes: usize = 512 << 20;
        /// Most frames of one post.
        max_frames: usize = 64, positive;
        /// Most bytes of one encoded frame.
        max_frame_bytes: usize = bagtrack_ingest::Limits::default().max_bytes, positive;
        /// Longest side of a frame in pixels.
        max_frame_side: u32 = bagtrack_ingest::Limits::default().max_side, positive;
        /// Most pixels of a frame.
        max_frame_pixels: u64 = bagtrack_ingest::Limits::default().max_pixels, positive;
        /// Most memory in bytes that decoding one frame may take.
        max_frame_memory: u64 = bagtrack_ingest::Limits::default().max_memory, positive;

        # "Connections"
        /// Most connections open at the same time.
        max_connections: usize = 4096, permits;
        /// Time for a client to send its request head, and for its TLS handshake before; a connection that is idle for
        /// longer is closed too.
        header_timeout: Duration = Duration::from_secs(30), moment;
        /// Time for a client to send its request body. Each 64 KiB of it give a second more.
        body_timeout: Duration = Duration::from_secs(30), moment;

        # "Access and keys"
        /// Origins of web pages that may use the service from elsewhere, like `https://example.org`, separated by
        /// commas; `*` for all. Requests of other pages are refused.
        cors_origins: Vec<String> = Vec::new(), |values| origins(values);

        # "Shutdown"
        /// On SIGTERM, /readyz answers 503 and no session can be opened for this long before connections are refused,
        /// so that load balancers notice, and clients take their sessions elsewhere. SIGINT leaves it out.
        shutdown_delay: Duration = Duration::from_secs(5), delay;
        /// Time for open requests to end on shutdown.
        shutdown_timeout: Duration = Duration::from_secs(20), delay;
    }
    flattened {
        /// The certificate that clients see.
        #[cfg(feature = "tls")]
        tls: TlsConfig;
        /// What one request and one client may take.
        limits: LimitsConfig;
        /// Where sessions are kept.
        store: StoreConfig;
        /// Who may use the service.
        access: AccessConfig;
    }
}

/// For this many bytes of a request body its client gets a second more, since a video may take longer than a frame.
pub const BODY_BYTES_PER_SECOND: u32 = 64 << 10;

impl Config {
    /// Checks every setting.
    ///
    /// # Errors
    /// A setting is out of its range; the error names the flag and the variable of the first such one.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.check_ranges()?;
        self.store.check_address()?;
        let held = in_range(
            self.model.is_some() || !self.model_in_doubt,
            "left out without --model",
        );
        ConfigError::check("model_in_doubt", held)?;
        let uploads = self.max_body_bytes..=(4 << 40);
        let held = in_range(
            uploads.contains(&self.max_upload_bytes),
            "at least max-body-bytes, at most 4 TiB",
        );
        ConfigError::check("max_upload_bytes", held)?;
        let share = self.limits.client_upload_bytes;
        let fits = share.is_none_or(|bytes| bytes >= self.max_body_bytes);
        let held = in_range(fits, "at least max-body-bytes");
        ConfigError::check("client_upload_bytes", held)
    }

    /// The number of workers, with its default.
    pub fn worker_count(&self) -> usize {
        self.workers.unwrap_or_else(cores)
    }

    /// The number of threads that serve connections. Reading and answering a request takes them about a tenth of the
    /// time that its frame takes a worker, and fewer threads are woken less often.
    pub fn network_threads(&self) -> usize {
        self.worker_count().div_ceil(8).clamp(1, cores())
    }

    /// How many videos are decoded at the same time. A client may have one of these places.
    pub fn video_places(&self) -> usize {
        self.worker_count().clamp(2, 4)
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

#[cfg(feature = "tls")]
settings! {
    /// The certificate that clients see. Without one the service speaks plain HTTP.
    pub struct TlsConfig {
        # "Listening"
        /// Speak HTTPS: a PEM file with the certificate of this host, then those of its issuers. SIGHUP reads it again.
        tls_cert: Option<PathBuf> = None;
        /// A PEM file with the private key of that certificate, ECDSA, RSA or Ed25519, without a passphrase.
        tls_key: Option<PathBuf> = None;
    }
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
        let config = Config {
            workers: Some(100_000),
            ..Config::default()
        };
        let message = config.validate().unwrap_err().to_string();
        assert_eq!(
            message,
            "--workers (BAGTRACK_WORKERS) must be from 1 to 1024"
        );
    }

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
