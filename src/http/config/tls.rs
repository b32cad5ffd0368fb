//! The settings of TLS.

use std::path::PathBuf;

/// The certificate that clients see. Without one the service speaks plain HTTP.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct TlsConfig {
    /// Speak HTTPS: a PEM file with the certificate of this host, then those of its issuers. SIGHUP reads it again.
    #[arg(
        long,
        env = "BAGTRACK_TLS_CERT",
        value_name = "FILE",
        requires = "tls_key"
    )]
    pub tls_cert: Option<PathBuf>,
    /// A PEM file with the private key of that certificate, ECDSA, RSA or Ed25519, without a passphrase.
    #[arg(
        long,
        env = "BAGTRACK_TLS_KEY",
        value_name = "FILE",
        requires = "tls_cert"
    )]
    pub tls_key: Option<PathBuf>,
}
