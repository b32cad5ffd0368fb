//! The range of every setting.

use super::service::Config;
use std::time::Duration;

/// A setting out of its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--{flag} (BAGTRACK_{variable}) must be {expected}")]
pub struct ConfigError {
    flag: &'static str,
    variable: String,
    expected: &'static str,
}

impl Config {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first setting that is out of its range, by its flag and variable.
    pub fn validate(&self) -> Result<(), ConfigError> {
        // The queue, the connections and the permits of a session are semaphores, which have this limit.
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
        let year = "at most 1 year";
        let semaphores = [
            ("workers", self.workers.unwrap_or(1)),
            ("queue", self.queue),
            ("session-queue", self.session_queue),
            ("max-connections", self.max_connections),
        ];
        let semaphores = semaphores.map(|(flag, n)| (flag, semaphore.contains(&n), positive));
        let counts = [
            ("max-sessions", self.max_sessions >= 1),
            ("max-body-bytes", self.max_body_bytes >= 1),
            ("max-frames", self.max_frames >= 1),
            ("max-frame-bytes", self.max_frame_bytes >= 1),
            ("max-frame-side", self.max_frame_side >= 1),
            ("max-frame-pixels", self.max_frame_pixels >= 1),
            ("max-frame-memory", self.max_frame_memory >= 1),
        ];
        let counts = counts.map(|(flag, holds)| (flag, holds, positive));
        let times = [
            ("session-idle", self.session_idle),
            ("session-first", self.session_first),
            ("header-timeout", self.header_timeout),
            ("body-timeout", self.body_timeout),
            ("work-timeout", self.work_timeout),
        ];
        let times = times.map(|(flag, time)| (flag, moment.contains(&time), duration));
        let others = [
            (
                "max-upload-bytes",
                uploads.contains(&self.max_upload_bytes),
                "at least max-body-bytes, at most 4 TiB",
            ),
            (
                "cors-origins",
                self.cors_origins.iter().all(is_origin),
                "origins like https://example.org, or *",
            ),
            ("shutdown-delay", self.shutdown_delay <= *moment.end(), year),
            (
                "shutdown-timeout",
                self.shutdown_timeout <= *moment.end(),
                year,
            ),
        ];
        let checks = semaphores
            .into_iter()
            .chain(counts)
            .chain(times)
            .chain(others);
        let limits = self.limits.checks(&moment, self.max_body_bytes);
        match checks
            .chain(limits)
            .chain(self.store.checks(&moment))
            .find(|(_, holds, _)| !holds)
        {
            None => Ok(()),
            Some((flag, _, expected)) => Err(ConfigError {
                flag,
                variable: flag.to_uppercase().replace('-', "_"),
                expected,
            }),
        }
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
    }
}
