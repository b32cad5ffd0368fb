//! An issuer of JSON Web Tokens: its keys, its key set, and its signatures.

use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use ring::rand::SystemRandom;
use ring::rsa::PublicKeyComponents;
use ring::signature::{
    self, ECDSA_P256_SHA256_FIXED_SIGNING, ECDSA_P384_SHA384_FIXED_SIGNING, EcdsaKeyPair,
    EcdsaSigningAlgorithm, Ed25519KeyPair, KeyPair, RsaEncoding, RsaKeyPair,
};
use serde_json::{Value, json};

/// An RSA private key of 2,048 bits, for tests only, since ring cannot make one.
const RSA_KEY: &[u8] = include_bytes!("issuer_rsa.pk8");

/// A private key of an issuer.
#[derive(Debug)]
pub struct IssuerKey {
    id: &'static str,
    pair: Pair,
}

#[derive(Debug)]
enum Pair {
    /// The names of the curve and of the algorithm, and the key.
    Ecdsa(&'static str, &'static str, EcdsaKeyPair),
    Ed25519(Ed25519KeyPair),
    /// The name of the algorithm, and the key.
    Rsa(&'static str, RsaKeyPair),
}

impl IssuerKey {
    /// A new key of the curve P-256, with this `kid`.
    pub fn p256(id: &'static str) -> Self {
        Self::ecdsa(id, ("P-256", "ES256"), &ECDSA_P256_SHA256_FIXED_SIGNING)
    }

    /// A new key of the curve P-384, with this `kid`.
    pub fn p384(id: &'static str) -> Self {
        Self::ecdsa(id, ("P-384", "ES384"), &ECDSA_P384_SHA384_FIXED_SIGNING)
    }

    /// A new Ed25519 key, with this `kid`.
    pub fn ed25519(id: &'static str) -> Self {
        let document = Ed25519KeyPair::generate_pkcs8(&SystemRandom::new()).expect("randomness");
        let pair = Ed25519KeyPair::from_pkcs8(document.as_ref()).expect("a key that was made so");
        Self {
            id,
            pair: Pair::Ed25519(pair),
        }
    }

    /// The RSA key, with this `kid`, which signs by this algorithm. It is the same key each time.
    pub fn rsa(id: &'static str, algorithm: &'static str) -> Self {
        let pair = RsaKeyPair::from_pkcs8(RSA_KEY).expect("a key of RSA");
        Self {
            id,
            pair: Pair::Rsa(algorithm, pair),
        }
    }

    fn ecdsa(
        id: &'static str,
        (curve, name): (&'static str, &'static str),
        algorithm: &'static EcdsaSigningAlgorithm,
    ) -> Self {
        let random = SystemRandom::new();
        let document = EcdsaKeyPair::generate_pkcs8(algorithm, &random).expect("randomness");
        let pair = EcdsaKeyPair::from_pkcs8(algorithm, document.as_ref(), &random);
        Self {
            id,
            pair: Pair::Ecdsa(curve, name, pair.expect("a key that was made so")),
        }
    }

    /// The public key, as a JSON Web Key.
    pub fn public(&self) -> Value {
        match &self.pair {
            Pair::Ecdsa(curve, name, pair) => {
                // The first byte marks an uncompressed point; both coordinates follow.
                let point = &pair.public_key().as_ref()[1..];
                let (x, y) = point.split_at(point.len() / 2);
                json!({
                    "kty": "EC", "crv": curve, "alg": name, "use": "sig", "kid": self.id,
                    "x": URL_SAFE_NO_PAD.encode(x), "y": URL_SAFE_NO_PAD.encode(y),
                })
            }
            Pair::Ed25519(pair) => {
                let x = URL_SAFE_NO_PAD.encode(pair.public_key());
                json!({ "kty": "OKP", "crv": "Ed25519", "kid": self.id, "x": x })
            }
            Pair::Rsa(_, pair) => {
                let PublicKeyComponents::<Vec<u8>> { n, e } = pair.public().into();
                let (n, e) = (URL_SAFE_NO_PAD.encode(n), URL_SAFE_NO_PAD.encode(e));
                json!({ "kty": "RSA", "kid": self.id, "n": n, "e": e })
            }
        }
    }

    pub fn sign(&self, claims: &Value) -> String {
        let name = match &self.pair {
            Pair::Ecdsa(_, name, _) | Pair::Rsa(name, _) => name,
            Pair::Ed25519(_) => "EdDSA",
        };
        let header = json!({ "alg": name, "typ": "JWT", "kid": self.id });
        self.sign_as(&header, claims)
    }

    /// Signs claims under this header.
    pub fn sign_as(&self, header: &Value, claims: &Value) -> String {
        let signed = unsigned(header, claims);
        let signature = match &self.pair {
            Pair::Ecdsa(_, _, pair) => {
                let signature = pair.sign(&SystemRandom::new(), signed.as_bytes());
                signature.expect("randomness").as_ref().to_vec()
            }
            Pair::Ed25519(pair) => pair.sign(signed.as_bytes()).as_ref().to_vec(),
            Pair::Rsa(name, pair) => {
                let mut signature = vec![0; pair.public().modulus_len()];
                let message = signed.as_bytes();
                let random = SystemRandom::new();
                let done = pair.sign(rsa_encoding(name), &random, message, &mut signature);
                done.expect("randomness");
                signature
            }
        };
        format!("{signed}.{}", URL_SAFE_NO_PAD.encode(signature))
    }
}

/// The padding and hash of an RSA algorithm by its name (RFC 7518, sections 3.3 and 3.5).
fn rsa_encoding(name: &str) -> &'static dyn RsaEncoding {
    match name {
        "RS256" => &signature::RSA_PKCS1_SHA256,
        "RS384" => &signature::RSA_PKCS1_SHA384,
        "RS512" => &signature::RSA_PKCS1_SHA512,
        "PS256" => &signature::RSA_PSS_SHA256,
        "PS384" => &signature::RSA_PSS_SHA384,
        "PS512" => &signature::RSA_PSS_SHA512,
        other => panic!("{other} is none of RSA"),
    }
}

/// The part of a token that is signed: header and claims, encoded.
pub fn unsigned(header: &Value, claims: &Value) -> String {
    let encode = |value: &Value| URL_SAFE_NO_PAD.encode(value.to_string());
    format!("{}.{}", encode(header), encode(claims))
}

pub fn key_set(keys: &[&IssuerKey]) -> String {
    let keys: Vec<Value> = keys.iter().map(|key| key.public()).collect();
    json!({ "keys": keys }).to_string()
}
