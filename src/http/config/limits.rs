//! The settings that bound what one request, one connection and one client may take.

use ipnet::IpNet;
use std::ffi::OsString;
use std::time::Duration;

use super::flag_values::parse_duration;

/// What one request, one connection and one client may take.
#[derive(Debug, Clone, clap::Args)]
pub struct LimitsConfig {
    /// Most pixels of the frames of one post together; a post of one frame has the limit of a frame.
    #[arg(
        long, env = "BAGTRACK_MAX_REQUEST_PIXELS",
        default_value_t = LimitsConfig::default().max_request_pixels
    )]
    pub max_request_pixels: u64,
    /// Most processor time of one request; looked at between its frames.
    #[arg(
        long, env = "BAGTRACK_MAX_REQUEST_CPU",
        default_value = shown(LimitsConfig::default().max_request_cpu),
        value_parser = parse_duration
    )]
    pub max_request_cpu: Duration,
    /// Least bytes a second of a request body, after its first `body-grace`.
    #[arg(
        long, env = "BAGTRACK_MIN_BODY_RATE",
        default_value_t = LimitsConfig::default().min_body_rate
    )]
    pub min_body_rate: u32,
    /// Time for a request body before its least rate counts.
    #[arg(
        long, env = "BAGTRACK_BODY_GRACE",
        default_value = shown(LimitsConfig::default().body_grace),
        value_parser = parse_duration
    )]
    pub body_grace: Duration,
    /// Least bytes a second at which a client takes answers, after `write-timeout` of waiting for it.
    #[arg(
        long, env = "BAGTRACK_MIN_ANSWER_RATE",
        default_value_t = LimitsConfig::default().min_answer_rate
    )]
    pub min_answer_rate: u32,
    /// A connection is closed when its client was waited for this long while it took no byte of an answer, or took them
    /// more slowly than `min-answer-rate`.
    #[arg(
        long, env = "BAGTRACK_WRITE_TIMEOUT",
        default_value = shown(LimitsConfig::default().write_timeout),
        value_parser = parse_duration
    )]
    pub write_timeout: Duration,
    /// Time for the answer to a client that has closed its side of the connection; then it counts as gone.
    #[arg(
        long, env = "BAGTRACK_HALF_CLOSE_TIMEOUT",
        default_value = shown(LimitsConfig::default().half_close_timeout),
        value_parser = parse_duration
    )]
    pub half_close_timeout: Duration,
    /// A stream is pinged this often; one whose client is not heard of in that time is closed.
    #[arg(
        long, env = "BAGTRACK_PING_INTERVAL",
        default_value = shown(LimitsConfig::default().ping_interval),
        value_parser = parse_duration
    )]
    pub ping_interval: Duration,
    /// Most frames of a video.
    #[arg(
        long, env = "BAGTRACK_MAX_VIDEO_FRAMES",
        default_value_t = LimitsConfig::default().max_video_frames
    )]
    pub max_video_frames: usize,
    /// The program that decodes videos: its name or path. `off` refuses videos.
    #[arg(
        long, env = "BAGTRACK_FFMPEG",
        default_value_t = LimitsConfig::default().ffmpeg
    )]
    pub ffmpeg: String,
    /// What starts that program with fewer rights, and its arguments, where there is something.
    #[arg(skip)]
    pub ffmpeg_launcher: Vec<OsString>,
    /// Most connections of one address, trusted proxies excepted [default: a quarter of `max-connections`].
    #[arg(long, env = "BAGTRACK_CLIENT_CONNECTIONS")]
    pub client_connections: Option<usize>,
    /// Most sessions of one client [default: a quarter of `max-sessions`].
    #[arg(long, env = "BAGTRACK_CLIENT_SESSIONS")]
    pub client_sessions: Option<usize>,
    /// Most bytes that the states of all sessions take together; larger parameters take more of it [default: 512 KiB
    /// for each of `max-sessions`].
    #[arg(long, env = "BAGTRACK_MAX_SESSION_BYTES")]
    pub max_session_bytes: Option<usize>,
    /// Most requests with a frame of one client at the same time [default: a quarter of `queue`].
    #[arg(long, env = "BAGTRACK_CLIENT_REQUESTS")]
    pub client_requests: Option<usize>,
    /// Most bytes of the request bodies of one client together [default: a quarter of `max-upload-bytes`].
    #[arg(long, env = "BAGTRACK_CLIENT_UPLOAD_BYTES")]
    pub client_upload_bytes: Option<usize>,
    /// Most frames a second of one client; 0 for no limit.
    #[arg(
        long, env = "BAGTRACK_CLIENT_FRAME_RATE",
        default_value_t = LimitsConfig::default().client_frame_rate
    )]
    pub client_frame_rate: u32,
    /// Addresses and networks, like `10.0.0.0/8`, separated by commas, whose `Forwarded` or `X-Forwarded-For` tells
    /// the client's address.
    #[arg(long, env = "BAGTRACK_TRUSTED_PROXIES", value_delimiter = ',', value_parser = network)]
    pub trusted_proxies: Vec<IpNet>,
}

/// A network, or a single address.
fn network(text: &str) -> Result<IpNet, String> {
    let address = || text.parse().map(|address: std::net::IpAddr| address.into());
    let network = text.parse().or_else(|_| address());
    network.map_err(|_| "neither an address nor a network like 10.0.0.0/8".to_owned())
}

/// A duration as flags have it.
pub fn shown(duration: Duration) -> String {
    humantime::format_duration(duration).to_string()
}

impl Default for LimitsConfig {
    fn default() -> Self {
        Self {
            max_request_pixels: 160_000_000,
            max_request_cpu: Duration::from_secs(5),
            min_body_rate: 4096,
            body_grace: Duration::from_secs(5),
            min_answer_rate: 4096,
            write_timeout: Duration::from_secs(30),
            half_close_timeout: Duration::from_secs(5),
            ping_interval: Duration::from_secs(20),
            max_video_frames: 3600,
            ffmpeg: "ffmpeg".to_owned(),
            ffmpeg_launcher: Vec::new(),
            client_connections: None,
            client_sessions: None,
            max_session_bytes: None,
            client_requests: None,
            client_upload_bytes: None,
            client_frame_rate: 0,
            trusted_proxies: Vec::new(),
        }
    }
}

impl LimitsConfig {
    /// Each setting that has a range: its flag, whether its value is inside, and what the range is. `moment` is the
    /// range of durations; `body` is the largest body.
    pub(super) fn checks(
        &self,
        moment: &std::ops::RangeInclusive<Duration>,
        body: usize,
    ) -> [(&'static str, bool, &'static str); 14] {
        let positive = "at least 1";
        let duration = "between 1ms and 1 year";
        let share = |share: Option<usize>| share.is_none_or(|share| share >= 1);
        [
            ("max-request-pixels", self.max_request_pixels >= 1, positive),
            (
                "max-request-cpu",
                moment.contains(&self.max_request_cpu),
                duration,
            ),
            ("max-video-frames", self.max_video_frames >= 1, positive),
            ("min-body-rate", self.min_body_rate >= 1, positive),
            ("min-answer-rate", self.min_answer_rate >= 1, positive),
            ("body-grace", moment.contains(&self.body_grace), duration),
            (
                "write-timeout",
                moment.contains(&self.write_timeout),
                duration,
            ),
            (
                "half-close-timeout",
                moment.contains(&self.half_close_timeout),
                duration,
            ),
            (
                "ping-interval",
                moment.contains(&self.ping_interval),
                duration,
            ),
            (
                "client-connections",
                share(self.client_connections),
                positive,
            ),
            ("client-sessions", share(self.client_sessions), positive),
            ("max-session-bytes", share(self.max_session_bytes), positive),
            ("client-requests", share(self.client_requests), positive),
            (
                "client-upload-bytes",
                self.client_upload_bytes.is_none_or(|bytes| bytes >= body),
                "at least max-body-bytes",
            ),
        ]
    }
}
