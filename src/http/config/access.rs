//! The settings of who may use the service.

use std::path::PathBuf;

/// A text that does not show itself in debug output.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    /// The text.
    pub fn text(&self) -> &str {
        &self.0
    }
}

impl From<&str> for Secret {
    fn from(text: &str) -> Self {
        Self(text.trim().to_owned())
    }
}

impl AsRef<[u8]> for Secret {
    fn as_ref(&self) -> &[u8] {
        self.0.as_bytes()
    }
}

impl std::fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Secret")
    }
}

/// Who may use the service. Secrets are better given by variables and files than by flags, which other users of the
/// machine can see.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct AccessConfig {
    /// API keys as `name:key`, separated by commas. A key has 16 to 256 visible characters.
    #[arg(
        long,
        env = "BAGTRACK_API_KEYS",
        hide_env_values = true,
        value_delimiter = ',',
        value_name = "NAME:KEY"
    )]
    pub api_keys: Vec<Secret>,
    /// File with an API key a line, as `name:key`; lines that begin with # are left out. Read again on SIGHUP.
    #[arg(long, env = "BAGTRACK_API_KEYS_FILE", value_name = "FILE")]
    pub api_keys_file: Option<PathBuf>,
    /// Serve everybody who can reach the address. Without API keys only this machine is served otherwise.
    #[arg(
        long, env = "BAGTRACK_NO_AUTH",
        value_parser = clap::builder::BoolishValueParser::new()
    )]
    pub no_auth: bool,
    /// Hosts that requests may name, like `example.org` or `example.org:8443`, separated by commas [default: all; the
    /// names and addresses of this machine for a service on a loopback address without API keys and trusted proxies].
    /// `/healthz`, `/readyz` and `/metrics` answer under any.
    #[arg(long, env = "BAGTRACK_ALLOWED_HOSTS", value_delimiter = ',')]
    pub allowed_hosts: Vec<String>,
    /// Secrets of at least 16 characters that snapshots and session tokens are signed with, separated by commas: the
    /// first signs, all are accepted. Without one, those of other processes are refused.
    #[arg(
        long,
        env = "BAGTRACK_SNAPSHOT_KEYS",
        hide_env_values = true,
        value_delimiter = ',',
        value_name = "SECRET"
    )]
    pub snapshot_keys: Vec<Secret>,
    /// Key that alone reads `/metrics`, at least 16 characters [default: every API key does].
    #[arg(
        long,
        env = "BAGTRACK_METRICS_KEY",
        hide_env_values = true,
        value_name = "KEY"
    )]
    pub metrics_key: Option<Secret>,
    /// Accept snapshots that are not signed with a secret, and sign none where no secret is given.
    #[arg(
        long, env = "BAGTRACK_UNSIGNED_SNAPSHOTS",
        value_parser = clap::builder::BoolishValueParser::new()
    )]
    pub unsigned_snapshots: bool,
}
