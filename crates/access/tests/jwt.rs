//! Tokens of an identity provider, and the keys that they are checked with.

#![cfg(feature = "jwt")]

use bagtrack_access::{JwtError, KeySource, SourceError, TokenError, TokenVerifier};
use bagtrack_config::JwtConfig;
use bagtrack_testing::issuer::{IssuerKey, key_set, unsigned};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

const ISSUER: &str = "https://login.example.org/";
const AUDIENCE: &str = "https://tracker.example.org";
/// Seconds since 1970.
const NOW: u64 = 1_800_000_000;

fn at(seconds: u64) -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)
}

fn config() -> JwtConfig {
    JwtConfig {
        jwt_issuer: Some(ISSUER.to_owned()),
        jwt_audience: vec!["another".to_owned(), AUDIENCE.to_owned()],
        ..JwtConfig::default()
    }
}

/// The claims of a good token, with these changed; null takes one away.
fn claims(changed: Value) -> Value {
    let mut claims = json!({
        "iss": ISSUER, "aud": ["others", AUDIENCE], "sub": "auth0|5f7c8e", "exp": NOW + 300, "nbf": NOW - 5,
    });
    for (name, value) in changed.as_object().unwrap() {
        claims[name] = value.clone();
    }
    let all = claims.as_object_mut().unwrap();
    all.retain(|_, value| !value.is_null());
    claims
}

/// Keys that a test changes. None: out of reach.
#[derive(Debug, Default)]
struct Source {
    keys: Mutex<Option<String>>,
    read: AtomicUsize,
}

impl Source {
    fn give(&self, keys: &[&IssuerKey]) {
        *self.keys.lock().unwrap() = Some(key_set(keys));
    }
}

impl KeySource for Source {
    fn read(&self) -> Result<String, SourceError> {
        self.read.fetch_add(1, Ordering::Relaxed);
        let keys = self.keys.lock().unwrap().clone();
        keys.ok_or_else(|| SourceError::new("the issuer", "it is away"))
    }
}

fn verifier(keys: &[&IssuerKey]) -> (TokenVerifier, Arc<Source>) {
    let source = Arc::new(Source::default());
    source.give(keys);
    let verifier = TokenVerifier::with_source(&config(), source.clone(), at(NOW));
    (verifier.unwrap(), source)
}

async fn name_in(verifier: &TokenVerifier, token: &str) -> Result<String, TokenError> {
    let identity = verifier.identify(token, at(NOW)).await?;
    assert_eq!(identity.expires, at(NOW + 300));
    assert!(verifier.may_have(&identity.owner));
    Ok(identity.owner.name().unwrap().to_owned())
}

#[tokio::test]
async fn a_token_speaks_for_its_subject_whatever_key_of_the_issuer_signed_it() {
    let keys = [
        IssuerKey::p384("r"),
        IssuerKey::p256("p"),
        IssuerKey::ed25519("e"),
    ];
    let (verifier, source) = verifier(&keys.each_ref());
    for key in &keys {
        let token = key.sign(&claims(json!({})));
        // The second time it is known.
        for _ in 0..2 {
            let name = name_in(&verifier, &token).await;
            assert_eq!(name.as_deref(), Ok("jwt:auth0|5f7c8e"), "{key:?}");
        }
    }
    assert_eq!(source.read.load(Ordering::Relaxed), 1);
    // Another claim may say whose the token is, and an audience stand alone.
    let config = JwtConfig {
        jwt_owner: "client_id".to_owned(),
        ..config()
    };
    let verifier = TokenVerifier::with_source(&config, source, at(NOW)).unwrap();
    let token = keys[1].sign(&claims(json!({ "client_id": "camera 7", "aud": AUDIENCE })));
    let name = name_in(&verifier, &token).await;
    assert_eq!(name.as_deref(), Ok("jwt:camera 7"));
}

#[tokio::test]
async fn a_token_that_is_not_for_this_service_is_told_why() {
    let (key, other) = (IssuerKey::p256("p"), IssuerKey::p256("p"));
    let (verifier, _) = verifier(&[&key]);
    let claim = |name: &str| TokenError::Claim(name.to_owned());
    for (changed, expected) in [
        (
            json!({ "iss": "https://elsewhere.example" }),
            TokenError::Issuer,
        ),
        (json!({ "iss": null }), claim("iss")),
        (json!({ "aud": "others" }), TokenError::Audience),
        (json!({ "aud": null }), claim("aud")),
        (json!({ "exp": NOW - 61 }), TokenError::Expired),
        (json!({ "exp": null }), claim("exp")),
        (json!({ "exp": "tomorrow" }), claim("exp")),
        (json!({ "exp": -1.0 }), claim("exp")),
        (json!({ "nbf": NOW + 61 }), TokenError::Early),
        (json!({ "sub": null }), claim("sub")),
        (json!({ "sub": "" }), claim("sub")),
        (json!({ "sub": 7 }), claim("sub")),
        (json!({ "sub": "a\nb" }), claim("sub")),
        (json!({ "sub": "x".repeat(256) }), claim("sub")),
    ] {
        let token = key.sign(&claims(changed.clone()));
        assert_eq!(name_in(&verifier, &token).await, Err(expected), "{changed}");
    }
    let token = other.sign(&claims(json!({})));
    assert_eq!(name_in(&verifier, &token).await, Err(TokenError::Signature));
    for text in ["", "a.b.c", "0123456789abcdef", "bagtrack"] {
        assert_eq!(
            name_in(&verifier, text).await,
            Err(TokenError::Form),
            "{text}"
        );
    }
}

/// RFC 8725, 2.1 and 3.1: the service must not take its own word for how a token is signed.
#[tokio::test]
async fn the_header_of_a_token_does_not_choose_how_it_is_checked() {
    let key = IssuerKey::p384("r");
    let (verifier, _) = verifier(&[&key]);
    let none = unsigned(&json!({ "alg": "none" }), &claims(json!({})));
    let refused = name_in(&verifier, &format!("{none}.")).await;
    assert_eq!(refused, Err(TokenError::Form));
    // Everybody knows the public key: as a shared secret it signs nothing.
    for algorithm in ["HS256", "HS384", "HS512", "ES256"] {
        let header = json!({ "alg": algorithm, "kid": "r" });
        let forged = format!("{}.c2lnbmF0dXJl", unsigned(&header, &claims(json!({}))));
        let refused = name_in(&verifier, &forged).await.unwrap_err();
        let is_told = matches!(refused, TokenError::Algorithm(_) | TokenError::UnknownKey);
        assert!(is_told, "{algorithm}: {refused}");
    }
}

#[tokio::test]
async fn keys_for_something_else_are_left_out_and_a_set_without_others_is_refused() {
    let (signing, encrypting) = (IssuerKey::p256("s"), IssuerKey::p256("e"));
    let mut of_encryption = encrypting.public();
    of_encryption["use"] = json!("enc");
    let secret = json!({ "kty": "oct", "kid": "o", "k": "c2VjcmV0" });
    let unknown = json!({ "kty": "AKP", "kid": "a", "alg": "ML-DSA-44", "pub": "AAAA" });
    let source = Arc::new(Source::default());
    let set =
        |keys: Value| *source.keys.lock().unwrap() = Some(json!({ "keys": keys }).to_string());
    set(json!([secret, unknown, of_encryption, signing.public()]));
    let verifier = TokenVerifier::with_source(&config(), source.clone(), at(NOW)).unwrap();
    let good = signing.sign(&claims(json!({})));
    assert!(name_in(&verifier, &good).await.is_ok());
    let wrong = encrypting.sign(&claims(json!({})));
    assert_eq!(
        name_in(&verifier, &wrong).await,
        Err(TokenError::UnknownKey)
    );

    set(json!([secret, unknown, of_encryption]));
    let refused = TokenVerifier::with_source(&config(), source.clone(), at(NOW)).unwrap_err();
    assert!(matches!(refused, JwtError::Keys(_)), "{refused}");
    *source.keys.lock().unwrap() = Some("<html>".to_owned());
    let refused = TokenVerifier::with_source(&config(), source, at(NOW)).unwrap_err();
    assert!(matches!(refused, JwtError::Keys(_)), "{refused}");
}

#[tokio::test]
async fn the_issuer_may_change_its_keys_and_be_away() {
    let (old, new) = (IssuerKey::p256("old"), IssuerKey::p256("new"));
    let (verifier, source) = verifier(&[&old]);
    let reads = || source.read.load(Ordering::Relaxed);
    let long = |key: &IssuerKey| key.sign(&claims(json!({ "exp": NOW + 7200 })));
    let (of_old, of_new) = (long(&old), long(&new));
    let taken = async |token: &str, seconds| verifier.identify(token, at(NOW + seconds)).await;

    source.give(&[&old, &new]);
    // Whoever invents names of keys has them read twice a minute, and no more.
    for seconds in 0..30 {
        assert_eq!(taken(&of_new, seconds).await, Err(TokenError::UnknownKey));
    }
    assert_eq!(reads(), 1);
    assert!(taken(&of_new, 30).await.is_ok());
    assert!(taken(&of_old, 31).await.is_ok());
    assert_eq!(reads(), 2);

    // Another key under the name of the one before: names need not be given.
    let other = IssuerKey::p256("new");
    let of_other = long(&other);
    source.give(&[&old, &other]);
    assert_eq!(taken(&of_other, 59).await, Err(TokenError::Signature));
    assert!(taken(&of_other, 60).await.is_ok());
    assert_eq!(taken(&of_new, 61).await, Err(TokenError::Signature));
    source.give(&[&old, &new]);
    assert!(taken(&of_new, 90).await.is_ok());
    assert_eq!(reads(), 4);

    // A key that was taken back is good for ten minutes at most, whatever was checked with it.
    source.give(&[&new]);
    assert!(taken(&of_old, 689).await.is_ok());
    assert_eq!(taken(&of_old, 690).await, Err(TokenError::UnknownKey));
    assert_eq!(reads(), 5);

    // While the issuer is away, its keys stay.
    *source.keys.lock().unwrap() = None;
    assert!(taken(&of_new, 1300).await.is_ok());
    assert!(taken(&of_new, 1301).await.is_ok());
    assert_eq!(reads(), 6);
    assert!(verifier.reload(at(NOW + 1302)).is_err());
    assert!(taken(&of_new, 1303).await.is_ok());
    // They end with their time all the same.
    assert_eq!(taken(&of_new, 7260).await, Err(TokenError::Expired));
}

/// Answers each path with its text.
fn serve(paths: Vec<(String, String)>, listener: TcpListener) {
    std::thread::spawn(move || {
        for connection in listener.incoming() {
            let mut connection = connection.unwrap();
            let mut head = [0; 2048];
            let length = connection.read(&mut head).unwrap();
            let head = String::from_utf8_lossy(&head[..length]).into_owned();
            let path = head.split(' ').nth(1).unwrap_or("/");
            let found = paths.iter().find(|(known, _)| known == path);
            let answer = match found {
                Some((_, text)) => format!(
                    "HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{text}",
                    text.len()
                ),
                None => "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
                    .to_owned(),
            };
            connection.write_all(answer.as_bytes()).unwrap();
        }
    });
}

#[tokio::test]
async fn keys_come_from_a_file_from_an_address_and_from_where_the_issuer_says() {
    let key = IssuerKey::p256("p");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.json");
    std::fs::write(&file, key_set(&[&key])).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let discovery = json!({ "issuer": url, "jwks_uri": format!("{url}/keys") });
    serve(
        vec![
            ("/keys".to_owned(), key_set(&[&key])),
            (
                "/realm/.well-known/openid-configuration".to_owned(),
                discovery.to_string(),
            ),
        ],
        listener,
    );
    let issuer = format!("{url}/realm/");
    let token = key.sign(&claims(json!({ "iss": issuer })));
    let with = |keys: Option<String>| JwtConfig {
        jwt_issuer: Some(issuer.clone()),
        jwt_keys: keys,
        ..config()
    };
    let load = |keys| TokenVerifier::load(&with(keys), at(NOW));
    for keys in [
        Some(file.display().to_string()),
        Some(format!("{url}/keys")),
        None,
    ] {
        let verifier = load(keys.clone()).unwrap().unwrap();
        let name = name_in(&verifier, &token).await;
        assert_eq!(name.as_deref(), Ok("jwt:auth0|5f7c8e"), "{keys:?}");
    }
    // A pipe nobody writes to would be read for ever.
    let pipe = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let refused = load(Some(pipe.display().to_string())).unwrap_err();
    assert!(refused.to_string().contains("no regular file"), "{refused}");
    for missing in [format!("{url}/other"), format!("{}.bak", file.display())] {
        let refused = load(Some(missing.clone())).unwrap_err().to_string();
        assert!(
            refused.contains(&missing) && refused.contains("--jwt-keys"),
            "{refused}"
        );
    }
}

#[test]
fn an_issuer_alone_or_an_audience_alone_is_refused() {
    let none = TokenVerifier::load(&JwtConfig::default(), at(NOW));
    assert!(none.unwrap().is_none());
    for config in [
        JwtConfig {
            jwt_issuer: None,
            ..config()
        },
        JwtConfig {
            jwt_audience: Vec::new(),
            ..config()
        },
    ] {
        let refused = TokenVerifier::with_source(&config, Arc::new(Source::default()), at(NOW));
        assert!(matches!(refused, Err(JwtError::Incomplete)));
    }
    let alone = JwtConfig {
        jwt_issuer: None,
        ..config()
    };
    assert!(matches!(
        TokenVerifier::load(&alone, at(NOW)),
        Err(JwtError::Incomplete)
    ));
}
