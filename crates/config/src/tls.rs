//! The settings of TLS.

use super::settings::settings;
use std::path::PathBuf;

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
