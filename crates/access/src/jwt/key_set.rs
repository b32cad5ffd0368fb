//! The public keys of an issuer (RFC 7517).

use jsonwebtoken::jwk::{AlgorithmParameters, EllipticCurve, Jwk, PublicKeyUse};
use jsonwebtoken::{Algorithm, DecodingKey};
use serde::Deserialize;

/// Why a text is no key set.
#[derive(Debug, thiserror::Error)]
pub enum KeySetError {
    /// The text has another form.
    #[error("it is no JSON Web Key Set (RFC 7517): {0}")]
    Form(#[from] serde_json::Error),
    /// The set has no key that can check signatures.
    #[error(
        "it has no public key of RSA, of the curves P-256 and P-384, or of Ed25519, to check signatures with"
    )]
    Empty,
}

/// A public key, and the algorithms whose signatures it may check.
#[derive(Debug)]
pub(super) struct PublicKey {
    id: Option<String>,
    algorithms: &'static [Algorithm],
    pub(super) key: DecodingKey,
}

/// The public keys of an issuer.
#[derive(Debug, Default)]
pub(super) struct KeySet(Vec<PublicKey>);

#[derive(Deserialize)]
struct Document {
    keys: Vec<serde_json::Value>,
}

impl KeySet {
    /// Reads a key set. Keys of kinds that are not known, and those that are for something else, are left out.
    pub(super) fn parse(text: &str) -> Result<Self, KeySetError> {
        let document: Document = serde_json::from_str(text)?;
        let keys = document.keys.into_iter();
        let keys = keys.filter_map(|key| PublicKey::of(&serde_json::from_value(key).ok()?));
        let keys: Vec<PublicKey> = keys.collect();
        match keys.is_empty() {
            true => Err(KeySetError::Empty),
            false => Ok(Self(keys)),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// The key that checks a token: the one that the token's header names or, if the header names none, the only one
    /// for `algorithm`.
    pub(super) fn find(&self, id: Option<&str>, algorithm: Algorithm) -> Option<&PublicKey> {
        let mut fitting = self.0.iter().filter(|key| {
            let is_named = id.is_none() || key.id.as_deref() == id;
            is_named && key.algorithms.contains(&algorithm)
        });
        let first = fitting.next();
        first.filter(|_| id.is_some() || fitting.next().is_none())
    }
}

impl PublicKey {
    /// The key, if it is a public key for signatures. Shared secrets are refused: whoever reads one could sign.
    fn of(key: &Jwk) -> Option<Self> {
        use Algorithm::{ES256, ES384, EdDSA, PS256, PS384, PS512, RS256, RS384, RS512};
        let signs = matches!(
            key.common.public_key_use,
            None | Some(PublicKeyUse::Signature)
        );
        let possible: &'static [Algorithm] = match &key.algorithm {
            AlgorithmParameters::RSA(_) => &[RS256, RS384, RS512, PS256, PS384, PS512],
            AlgorithmParameters::EllipticCurve(curve) => match curve.curve {
                EllipticCurve::P256 => &[ES256],
                EllipticCurve::P384 => &[ES384],
                _ => return None,
            },
            AlgorithmParameters::OctetKeyPair(_) => &[EdDSA],
            _ => return None,
        };
        // A key that names its algorithm is for no other.
        let algorithms = match key.common.key_algorithm {
            None => possible,
            Some(named) => {
                let named = Algorithm::try_from(named).ok()?;
                let at = possible.iter().position(|possible| *possible == named)?;
                &possible[at..=at]
            }
        };
        let decoding = DecodingKey::from_jwk(key).ok()?;
        signs.then(|| Self {
            id: key.common.key_id.clone(),
            algorithms,
            key: decoding,
        })
    }
}
