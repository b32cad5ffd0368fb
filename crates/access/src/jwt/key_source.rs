//! Where the public keys of an issuer come from.

use crate::keys::read_regular;
use serde::Deserialize;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use ureq::tls::{RootCerts, TlsConfig};

/// How long one answer may take.
const TIMEOUT: Duration = Duration::from_secs(5);
/// Most bytes of one answer; a key set has some thousand.
const MAX_BYTES: u64 = 1 << 20;

/// Why the keys cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{place}: {cause}")]
pub struct SourceError {
    place: String,
    cause: String,
}

impl SourceError {
    /// `place` cannot be read, for this cause.
    pub fn new(place: impl fmt::Display, cause: impl fmt::Display) -> Self {
        Self {
            place: place.to_string(),
            cause: cause.to_string(),
        }
    }
}

/// Where the keys of an issuer come from.
pub trait KeySource: fmt::Debug + Send + Sync {
    /// Reads the text of the key set. It may block.
    ///
    /// # Errors
    /// The key set cannot be read.
    fn read(&self) -> Result<String, SourceError>;
}

/// The source that the setting `keys` names: an address, or else a file. Without the setting, the key set that the
/// issuer names.
pub(super) fn named(keys: Option<&str>, issuer: &str) -> Arc<dyn KeySource> {
    match keys {
        Some(url) if is_url(url) => Arc::new(Url(url.to_owned())),
        Some(path) => Arc::new(File(path.into())),
        None => Arc::new(Issuer(issuer.trim_end_matches('/').to_owned())),
    }
}

fn is_url(text: &str) -> bool {
    ["https://", "http://"]
        .iter()
        .any(|scheme| text.starts_with(scheme))
}

/// A key set in a file.
#[derive(Debug)]
struct File(PathBuf);

impl KeySource for File {
    fn read(&self) -> Result<String, SourceError> {
        read_regular(&self.0).map_err(|error| SourceError::new(self.0.display(), error))
    }
}

/// A key set at an address.
#[derive(Debug)]
struct Url(String);

impl KeySource for Url {
    fn read(&self) -> Result<String, SourceError> {
        let read = || -> Result<String, ureq::Error> {
            let mut answer = agent().get(&self.0).call()?;
            let body = answer.body_mut().with_config().limit(MAX_BYTES);
            body.read_to_string()
        };
        read().map_err(|error| SourceError::new(&self.0, error))
    }
}

/// The key set that an issuer names (OpenID Connect Discovery 1.0, section 4).
#[derive(Debug)]
struct Issuer(String);

#[derive(Deserialize)]
struct Discovery {
    jwks_uri: String,
}

impl KeySource for Issuer {
    fn read(&self) -> Result<String, SourceError> {
        let place = format!("{}/.well-known/openid-configuration", self.0);
        let document = Url(place.clone()).read()?;
        let document: Discovery = serde_json::from_str(&document)
            .map_err(|error| SourceError::new(place, format!("no jwks_uri: {error}")))?;
        Url(document.jwks_uri).read()
    }
}

/// The HTTP client, which trusts the certificates that the machine trusts.
fn agent() -> ureq::Agent {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let tls = TlsConfig::builder()
        .unversioned_rustls_crypto_provider(provider)
        .root_certs(RootCerts::PlatformVerifier);
    let config = ureq::Agent::config_builder()
        .timeout_global(Some(TIMEOUT))
        .tls_config(tls.build());
    config.build().new_agent()
}
