//! Makes certificates and their keys, as files.

use crate::application::TestApplication;
use bagtrack::http::{Config, TlsConfig};
use rcgen::{
    BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair, PKCS_ECDSA_P256_SHA256,
    PKCS_ECDSA_P384_SHA384, PKCS_ED25519, SignatureAlgorithm,
};
use rustls::pki_types::CertificateDer;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Signs certificates: by a root that clients trust, and an intermediate issuer that clients do not know.
pub struct Authority {
    pub root: CertificateDer<'static>,
    intermediate: String,
    issuer: Issuer<'static, KeyPair>,
}

/// The files of a certificate for this machine.
pub struct Files {
    folder: TempDir,
}

/// The types of keys, with their names.
pub fn kinds() -> [(&'static str, &'static SignatureAlgorithm); 3] {
    [
        ("ECDSA P-256", &PKCS_ECDSA_P256_SHA256),
        ("ECDSA P-384", &PKCS_ECDSA_P384_SHA384),
        ("Ed25519", &PKCS_ED25519),
    ]
}

fn authority_params() -> CertificateParams {
    let mut params = CertificateParams::new(Vec::new()).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params
}

fn host_params() -> CertificateParams {
    let names = ["localhost".to_owned(), "127.0.0.1".to_owned()];
    CertificateParams::new(names).unwrap()
}

impl Authority {
    pub fn new() -> Self {
        let (root_key, key) = (KeyPair::generate().unwrap(), KeyPair::generate().unwrap());
        let mut root_params = authority_params();
        root_params
            .distinguished_name
            .push(rcgen::DnType::CommonName, "root");
        let root = root_params.self_signed(&root_key).unwrap();
        let root_issuer = Issuer::new(root_params, root_key);
        let intermediate = authority_params().signed_by(&key, &root_issuer).unwrap();
        Self {
            root: root.der().clone(),
            intermediate: intermediate.pem(),
            issuer: Issuer::new(authority_params(), key),
        }
    }

    /// A certificate for a new key, followed by that of the issuer.
    pub fn issue(&self, kind: &'static SignatureAlgorithm) -> Files {
        let files = Files {
            folder: tempfile::tempdir().unwrap(),
        };
        self.issue_into(&files, kind);
        files
    }

    /// Overwrites these files with a certificate for a new key.
    pub fn issue_into(&self, files: &Files, kind: &'static SignatureAlgorithm) {
        self.write(files, kind, host_params());
    }

    /// Overwrites these files with a certificate that is valid from one year to the other.
    pub fn issue_for_years(&self, files: &Files, [from, to]: [i32; 2]) {
        let mut params = host_params();
        params.not_before = rcgen::date_time_ymd(from, 1, 1);
        params.not_after = rcgen::date_time_ymd(to, 1, 1);
        self.write(files, &PKCS_ECDSA_P256_SHA256, params);
    }

    fn write(&self, files: &Files, kind: &'static SignatureAlgorithm, params: CertificateParams) {
        let key = KeyPair::generate_for(kind).unwrap();
        let certificate = params.signed_by(&key, &self.issuer).unwrap();
        let chain = certificate.pem() + &self.intermediate;
        std::fs::write(files.certificate(), chain).unwrap();
        std::fs::write(files.key(), key.serialize_pem()).unwrap();
    }
}

impl Files {
    pub fn certificate(&self) -> PathBuf {
        self.folder.path().join("certificate.pem")
    }

    pub fn key(&self) -> PathBuf {
        self.folder.path().join("key.pem")
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The service in this process, with this certificate.
    pub async fn service(&self, change: impl FnOnce(&mut Config)) -> TestApplication {
        TestApplication::start_with(|config| {
            config.tls = TlsConfig {
                tls_cert: Some(self.certificate()),
                tls_key: Some(self.key()),
            };
            change(config);
        })
        .await
    }
}
