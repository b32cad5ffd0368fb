//! The headings of `bagtrack serve --help`: its flags by subject.

use clap::Arg;

/// Each heading, and the flags below it.
const HEADINGS: [(&str, &[&str]); 10] = [
    (
        "Listening",
        &[
            "listen",
            "base_path",
            "tls_cert",
            "tls_key",
            "trusted_proxies",
        ],
    ),
    (
        "Work and queues",
        &[
            "workers",
            "queue",
            "session_queue",
            "queue_delay",
            "work_timeout",
            "max_request_cpu",
        ],
    ),
    (
        "Sessions",
        &[
            "max_sessions",
            "session_idle",
            "session_first",
            "max_session_bytes",
            "model",
            "model_in_doubt",
        ],
    ),
    (
        "Uploads",
        &[
            "max_body_bytes",
            "max_upload_bytes",
            "max_frames",
            "max_frame_bytes",
            "max_frame_side",
            "max_frame_pixels",
            "max_frame_memory",
            "max_request_pixels",
            "max_video_frames",
            "ffmpeg",
        ],
    ),
    (
        "Connections",
        &[
            "max_connections",
            "header_timeout",
            "body_timeout",
            "body_grace",
            "min_body_rate",
            "min_answer_rate",
            "write_timeout",
            "half_close_timeout",
            "ping_interval",
        ],
    ),
    (
        "Quotas of a client",
        &[
            "client_connections",
            "client_sessions",
            "client_requests",
            "client_upload_bytes",
            "client_frame_rate",
        ],
    ),
    (
        "Access and keys",
        &[
            "api_keys",
            "api_keys_file",
            "no_auth",
            "jwt_issuer",
            "jwt_audience",
            "jwt_keys",
            "jwt_owner",
            "allowed_hosts",
            "cors_origins",
            "snapshot_keys",
            "unsigned_snapshots",
            "metrics_key",
        ],
    ),
    (
        "Store",
        &[
            "store",
            "durability",
            "store_every",
            "store_timeout",
            "store_prefix",
        ],
    ),
    ("Shutdown", &["shutdown_delay", "shutdown_timeout"]),
    ("Logging", &["log", "log_format"]),
];

/// Puts a flag of `serve` below its heading. One that has none is below "Options", as `--help` is.
pub fn put(flag: Arg) -> Arg {
    let id = flag.get_id().as_str();
    match HEADINGS.iter().find(|(_, flags)| flags.contains(&id)) {
        Some((heading, _)) => flag.help_heading(*heading),
        None => flag,
    }
}
