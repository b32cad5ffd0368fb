//! The settings that bound what one request, one connection and one client may take.

use super::settings::{moment, positive, positive_share, settings};
use bagtrack_ingest::video::Launcher;
use ipnet::IpNet;
use std::time::Duration;

/// This value of the setting `ffmpeg` refuses videos.
pub const OFF: &str = "off";

settings! {
    /// What one request, one connection and one client may take.
    pub struct LimitsConfig {
        # "Uploads"
        /// Most pixels of the frames of one post together; a post of one frame has the limit of a frame.
        max_request_pixels: u64 = 160_000_000, positive;
        /// Most frames of a video that a request takes. Those before its `start` do not count.
        max_video_frames: usize = 3600, positive;
        /// The program that decodes videos: its name or path. `off` refuses videos.
        ffmpeg: String = "ffmpeg".to_owned();

        # "Work and queues"
        /// Most processor time of one request; looked at between its frames.
        max_request_cpu: Duration = Duration::from_secs(5), moment;

        # "Connections"
        /// Least bytes a second of a request body, after its first `body-grace`.
        min_body_rate: u32 = 4096, positive;
        /// Time for a request body before its least rate counts.
        body_grace: Duration = Duration::from_secs(5), moment;
        /// Least bytes a second at which a client takes answers, after `write-timeout` of waiting for it.
        min_answer_rate: u32 = 4096, positive;
        /// A connection is closed when its client was waited for this long while it took no byte of an answer, or took
        /// them more slowly than `min-answer-rate`.
        write_timeout: Duration = Duration::from_secs(30), moment;
        /// Time for the answer to a client that has closed its side of the connection; then it counts as gone.
        half_close_timeout: Duration = Duration::from_secs(5), moment;
        /// A stream is pinged this often; one whose client is not heard of in that time is closed.
        ping_interval: Duration = Duration::from_secs(20), moment;

        # "Quotas of a client"
        /// Most connections of one address, trusted proxies excepted [default: a quarter of `max-connections`].
        client_connections: Option<usize> = None, positive_share;
        /// Most sessions of one client [default: a quarter of `max-sessions`].
        client_sessions: Option<usize> = None, positive_share;
        /// Most requests with a frame of one client at the same time [default: a quarter of `queue`].
        client_requests: Option<usize> = None, positive_share;
        /// Most bytes of the request bodies of one client together [default: a quarter of `max-upload-bytes`].
        client_upload_bytes: Option<usize> = None;
        /// Most frames a second of one client; 0 for no limit.
        client_frame_rate: u32 = 0;

        # "Sessions"
        /// Most bytes that the states of all sessions take together; larger parameters take more of it [default: 512
        /// KiB for each of `max-sessions`].
        max_session_bytes: Option<usize> = None, positive_share;

        # "Listening"
        /// Addresses and networks, like `10.0.0.0/8`, separated by commas, whose `Forwarded` or `X-Forwarded-For` tells
        /// the client's address.
        trusted_proxies: Vec<IpNet> = Vec::new();
    }
    by_code {
        /// What starts the program that decodes videos, with fewer rights. The program `bagtrack` starts itself so.
        ffmpeg_launcher: Launcher;
    }
}
