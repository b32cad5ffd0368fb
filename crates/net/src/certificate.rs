//! The certificate that clients see, and its private key.

use rustls::pki_types::pem::{Error as PemError, PemObject};
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, crypto::ring};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::SystemTime;
use tokio_rustls::TlsAcceptor;
use x509_cert::certificate::{CertificateInner, Rfc5280};
use x509_cert::der::Decode;

/// The only protocol within TLS.
const PROTOCOL: &[u8] = b"http/1.1";

/// Why there is no certificate to show.
#[derive(Debug, thiserror::Error)]
pub enum CertificateError {
    /// Only one of the two files, certificate and key, is named.
    #[error(
        "a certificate needs its key: give both --tls-cert (BAGTRACK_TLS_CERT) and --tls-key (BAGTRACK_TLS_KEY)"
    )]
    Half,
    /// A file cannot be read.
    #[error("{path} (--{flag}) cannot be read: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The flag that names it.
        flag: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// The certificate's file has no certificate in PEM.
    #[error(
        "{path} (--tls-cert) has no certificate in PEM ({reason}): it must have the lines between \
         `-----BEGIN CERTIFICATE-----` and `-----END CERTIFICATE-----`; `openssl x509 -inform DER -in FILE` makes them \
         of a DER file"
    )]
    NoCertificate {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The key's file has no private key in PEM that can be used.
    #[error(
        "{path} (--tls-key) has no private key in PEM that can be used ({reason}): `openssl pkey -in FILE -out FILE` \
         takes a passphrase off and makes PEM of other formats"
    )]
    NoKey {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The certificate and the key are no pair, or their kind is not supported.
    #[error(
        "{cert} (--tls-cert) and {key} (--tls-key) cannot be used together: {reason}. The first certificate of the file \
         must be that of the key, of X.509 version 3, and ECDSA (P-256, P-384), RSA (2048 bits or more) or Ed25519"
    )]
    Pair {
        /// The certificate's file.
        cert: PathBuf,
        /// The key's file.
        key: PathBuf,
        /// What is wrong with them.
        reason: rustls::Error,
    },
}

/// The certificate and its key. Clones share them.
#[derive(Debug, Clone)]
pub struct Certificate(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    cert: PathBuf,
    key: PathBuf,
    current: RwLock<Arc<ServerConfig>>,
}

impl Certificate {
    /// Reads the certificate of these files; `None` where neither is named. The log warns of a certificate that clients
    /// refuse at `now`.
    ///
    /// # Errors
    /// See [`CertificateError`].
    pub fn load(
        cert: Option<&Path>,
        key: Option<&Path>,
        now: SystemTime,
    ) -> Result<Option<Self>, CertificateError> {
        match (cert, key) {
            (None, None) => Ok(None),
            (Some(cert), Some(key)) => Ok(Some(Self(Arc::new(Inner {
                current: RwLock::new(Arc::new(server_config(cert, key, now)?)),
                cert: cert.to_owned(),
                key: key.to_owned(),
            })))),
            _ => Err(CertificateError::Half),
        }
    }

    /// Reads the files again. Open connections keep the former certificate.
    ///
    /// # Errors
    /// See [`CertificateError`]. The certificate then stays as it was.
    pub fn reload(&self, now: SystemTime) -> Result<(), CertificateError> {
        check_regular(&self.0.cert, "tls-cert")?;
        check_regular(&self.0.key, "tls-key")?;
        let read = Arc::new(server_config(&self.0.cert, &self.0.key, now)?);
        let current = self.0.current.write();
        // Nothing panics while the lock is held.
        *current.unwrap_or_else(PoisonError::into_inner) = read;
        Ok(())
    }

    /// The acceptor of connections with the current certificate.
    pub fn acceptor(&self) -> TlsAcceptor {
        let current = self.0.current.read();
        TlsAcceptor::from(current.unwrap_or_else(PoisonError::into_inner).clone())
    }
}

fn server_config(
    cert: &Path,
    key: &Path,
    now: SystemTime,
) -> Result<ServerConfig, CertificateError> {
    let (chain, private) = (chain(cert)?, private_key(key)?);
    for certificate in &chain {
        warn_of_time(cert, certificate, now);
    }
    let pair = |reason| CertificateError::Pair {
        cert: cert.to_owned(),
        key: key.to_owned(),
        reason,
    };
    let builder = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()));
    let builder = builder
        .with_safe_default_protocol_versions()
        .map_err(pair)?;
    let mut config = builder
        .with_no_client_auth()
        .with_single_cert(chain, private)
        .map_err(pair)?;
    config.alpn_protocols = vec![PROTOCOL.to_vec()];
    Ok(config)
}

fn chain(path: &Path) -> Result<Vec<CertificateDer<'static>>, CertificateError> {
    let text = read(path, "tls-cert")?;
    let no_certificate = |reason| CertificateError::NoCertificate {
        path: path.to_owned(),
        reason,
    };
    let chain: Result<Vec<_>, PemError> = CertificateDer::pem_slice_iter(&text).collect();
    match chain {
        Ok(chain) if chain.is_empty() => Err(no_certificate("there is none".to_owned())),
        Ok(chain) => Ok(chain),
        Err(error) => Err(no_certificate(error.to_string())),
    }
}

/// Warns of a certificate that has ended, or has not begun. A certificate that cannot be parsed is refused elsewhere.
fn warn_of_time(path: &Path, certificate: &CertificateDer<'_>, now: SystemTime) {
    let Ok(read) = CertificateInner::<Rfc5280>::from_der(certificate) else {
        return;
    };
    let validity = read.tbs_certificate().validity();
    let (path, subject) = (path.display(), read.tbs_certificate().subject());
    let (begins, ends) = (validity.not_before, validity.not_after);
    if now > ends.to_system_time() {
        tracing::warn!(%subject, "{path} (--tls-cert) has ended on {ends}: clients refuse it; renew it, then send SIGHUP");
    } else if now < begins.to_system_time() {
        tracing::warn!(%subject, "{path} (--tls-cert) begins on {begins}: clients refuse it until then");
    }
}

fn private_key(path: &Path) -> Result<PrivateKeyDer<'static>, CertificateError> {
    let text = read(path, "tls-key")?;
    PrivateKeyDer::from_pem_slice(&text).map_err(|error| CertificateError::NoKey {
        path: path.to_owned(),
        reason: match error {
            PemError::NoItemsFound => "there is none, or it has a passphrase".to_owned(),
            other => other.to_string(),
        },
    })
}

fn read(path: &Path, flag: &'static str) -> Result<Vec<u8>, CertificateError> {
    std::fs::read(path).map_err(|source| unreadable(path, flag, source))
}

/// Refuses files that are not regular: reading a pipe again, whose writer has gone, would block for ever.
fn check_regular(path: &Path, flag: &'static str) -> Result<(), CertificateError> {
    let file = std::fs::metadata(path);
    let refused = match file {
        Ok(file) if file.is_file() => return Ok(()),
        Ok(_) => io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file"),
        Err(error) => error,
    };
    Err(unreadable(path, flag, refused))
}

fn unreadable(path: &Path, flag: &'static str, source: io::Error) -> CertificateError {
    CertificateError::File {
        path: path.to_owned(),
        flag,
        source,
    }
}
