//! Tokens of an identity provider, and the keys that they are checked with.

#![cfg(feature = "jwt")]

use bagtrack_access::{
    Access, AccessError, Credential, JwtError, KeySource, NotIdentified, SourceError, TokenError,
    TokenVerifier,
};
use bagtrack_config::{AccessConfig, JwtConfig, Secret};
use bagtrack_sessions::Owner;
use bagtrack_testing::issuer::{IssuerKey, key_set, unsigned};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

const ISSUER: &str = "https://login.example.org/";
const AUDIENCE: &str = "https://tracker.example.org";
const SHORT: Duration = Duration::from_millis(10);
/// Longer than anything takes that the tests wait for.
const PATIENCE: Duration = Duration::from_secs(20);
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

/// The claims of a good token, with the `changed` ones; null takes a claim away.
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

/// Keys that a test changes; `None` where the issuer is out of reach.
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
    // Clocks may differ by a minute.
    assert_eq!(identity.expires, at(NOW + 300 + 60));
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
        // The second time the token is remembered.
        for _ in 0..2 {
            let name = name_in(&verifier, &token).await;
            assert_eq!(name.as_deref(), Ok("jwt:auth0|5f7c8e"), "{key:?}");
        }
    }
    assert_eq!(source.read.load(Ordering::Relaxed), 1);
    // Another claim may name the owner, and the audience may be a text instead of a list.
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
async fn a_key_of_rsa_signs_with_its_six_algorithms() {
    for name in ["RS256", "RS384", "RS512", "PS256", "PS384", "PS512"] {
        let key = IssuerKey::rsa("r", name);
        let (verifier, _) = verifier(&[&key]);
        let token = key.sign(&claims(json!({})));
        let taken = name_in(&verifier, &token).await;
        assert_eq!(taken.as_deref(), Ok("jwt:auth0|5f7c8e"), "{name}");
        // The signature is of the same key, but of other claims.
        let (_, signature) = token.rsplit_once('.').unwrap();
        let header = json!({ "alg": name, "kid": "r" });
        let forged = unsigned(&header, &claims(json!({ "sub": "another" })));
        let refused = name_in(&verifier, &format!("{forged}.{signature}")).await;
        assert_eq!(refused, Err(TokenError::Signature), "{name}");
    }
}

#[tokio::test]
async fn a_key_that_names_its_algorithm_is_for_no_other() {
    let (of_256, of_512) = (IssuerKey::rsa("r", "RS256"), IssuerKey::rsa("r", "PS512"));
    for (named, takes_256, takes_512) in [("RS256", true, false), ("PS512", false, true)] {
        let mut public = of_256.public();
        public["alg"] = json!(named);
        let source = Arc::new(Source::default());
        *source.keys.lock().unwrap() = Some(json!({ "keys": [public] }).to_string());
        let verifier = TokenVerifier::with_source(&config(), source, at(NOW)).unwrap();
        for (key, is_taken) in [(&of_256, takes_256), (&of_512, takes_512)] {
            let taken = name_in(&verifier, &key.sign(&claims(json!({})))).await;
            match is_taken {
                true => assert!(taken.is_ok(), "{named}: {taken:?}"),
                false => assert_eq!(taken, Err(TokenError::UnknownKey), "{named}"),
            }
        }
    }
}

#[tokio::test]
async fn a_token_names_its_key_unless_one_alone_can_have_signed_it() {
    let (one, other) = (IssuerKey::p256("one"), IssuerKey::p256("other"));
    let of_another_kind = IssuerKey::ed25519("e");
    let nameless = one.sign_as(&json!({ "alg": "ES256" }), &claims(json!({})));
    let (alone, _) = verifier(&[&one, &of_another_kind]);
    assert!(name_in(&alone, &nameless).await.is_ok());
    let (two, _) = verifier(&[&one, &other, &of_another_kind]);
    let refused = name_in(&two, &nameless).await;
    assert_eq!(refused, Err(TokenError::UnknownKey));
}

/// The clocks of issuer and service may be a minute apart.
#[tokio::test]
async fn a_token_holds_a_minute_before_and_after_its_times() {
    let key = IssuerKey::p256("p");
    let token = key.sign(&claims(json!({ "nbf": NOW + 60 })));
    let early = verifier(&[&key]).0.identify(&token, at(NOW - 1)).await;
    assert_eq!(early, Err(TokenError::Early));
    for (seconds, expected) in [
        (0, None),
        (359, None),
        (360, Some(TokenError::Expired)),
        (361, Some(TokenError::Expired)),
    ] {
        // A token that was checked before ends at the same moment.
        for is_known in [false, true] {
            let (verifier, _) = verifier(&[&key]);
            if is_known {
                verifier.identify(&token, at(NOW)).await.unwrap();
            }
            let taken = verifier.identify(&token, at(NOW + seconds)).await;
            assert_eq!(taken.err(), expected, "{is_known} {seconds}");
        }
    }
}

#[tokio::test]
async fn a_subject_may_have_255_bytes() {
    let key = IssuerKey::p256("p");
    let (verifier, _) = verifier(&[&key]);
    let longest = "x".repeat(255);
    let token = key.sign(&claims(json!({ "sub": longest })));
    assert_eq!(
        name_in(&verifier, &token).await,
        Ok(format!("jwt:{longest}"))
    );
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
        (
            json!({ "iss": [ISSUER, "https://elsewhere.example"] }),
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

/// RFC 8725, 2.1 and 3.1: the service must not trust the token's header for how the token is signed.
#[tokio::test]
async fn the_header_of_a_token_does_not_choose_how_it_is_checked() {
    let key = IssuerKey::p384("r");
    let (verifier, _) = verifier(&[&key]);
    let none = unsigned(&json!({ "alg": "none" }), &claims(json!({})));
    let refused = name_in(&verifier, &format!("{none}.")).await;
    assert_eq!(refused, Err(TokenError::Form));
    // Everybody knows the public key, so it must not be taken as a shared secret.
    for algorithm in ["HS256", "HS384", "HS512", "ES256"] {
        let header = json!({ "alg": algorithm, "kid": "r" });
        let forged = format!("{}.c2lnbmF0dXJl", unsigned(&header, &claims(json!({}))));
        let refused = name_in(&verifier, &forged).await.unwrap_err();
        let is_told = matches!(refused, TokenError::Algorithm(_) | TokenError::UnknownKey);
        assert!(is_told, "{algorithm}: {refused}");
    }
    for critical in [json!(["urn:example:once"]), json!([])] {
        let header = json!({ "alg": "ES384", "kid": "r", "crit": critical });
        let token = key.sign_as(&header, &claims(json!({})));
        assert_eq!(name_in(&verifier, &token).await, Err(TokenError::Critical));
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
    // Tokens with invented names of keys make the service read the keys twice a minute at most.
    for seconds in 0..30 {
        assert_eq!(taken(&of_new, seconds).await, Err(TokenError::UnknownKey));
    }
    assert_eq!(reads(), 1);
    assert!(taken(&of_new, 30).await.is_ok());
    assert!(taken(&of_old, 31).await.is_ok());
    assert_eq!(reads(), 2);

    // The issuer replaces a key by another one under the same name.
    let other = IssuerKey::p256("new");
    let of_other = long(&other);
    source.give(&[&old, &other]);
    assert_eq!(taken(&of_other, 59).await, Err(TokenError::Signature));
    assert!(taken(&of_other, 60).await.is_ok());
    assert_eq!(taken(&of_new, 61).await, Err(TokenError::Signature));
    source.give(&[&old, &new]);
    assert!(taken(&of_new, 90).await.is_ok());
    assert_eq!(reads(), 4);

    // A revoked key is good for ten minutes at most, also for tokens that were checked with it before.
    source.give(&[&new]);
    assert!(taken(&of_old, 689).await.is_ok());
    // The token that finds the keys old does not wait for them, and they are read once.
    while taken(&of_old, 690).await.is_ok() {
        tokio::time::sleep(SHORT).await;
    }
    assert_eq!(taken(&of_old, 691).await, Err(TokenError::UnknownKey));
    assert_eq!(reads(), 5);

    // While the issuer is away, its keys stay.
    *source.keys.lock().unwrap() = None;
    while reads() < 6 {
        assert!(taken(&of_new, 1300).await.is_ok());
        tokio::time::sleep(SHORT).await;
    }
    assert!(taken(&of_new, 1301).await.is_ok());
    assert_eq!(reads(), 6);
    assert!(verifier.reload(at(NOW + 1302)).is_err());
    assert!(taken(&of_new, 1303).await.is_ok());
    source.give(&[&new, &old]);
    assert_eq!(verifier.reload(at(NOW + 1304)).unwrap(), 2);
    // A key that was revoked while no token came is refused at once.
    source.give(&[&new]);
    assert_eq!(taken(&of_old, 2504).await, Err(TokenError::UnknownKey));
    // Remembered tokens end with their time all the same.
    assert_eq!(taken(&of_new, 7260).await, Err(TokenError::Expired));
}

/// An issuer that answers once, and then hangs until it is let go.
#[derive(Debug)]
struct Hanging {
    keys: Mutex<Option<String>>,
    let_go: Mutex<Receiver<()>>,
}

impl KeySource for Hanging {
    fn read(&self) -> Result<String, SourceError> {
        if let Some(keys) = self.keys.lock().unwrap().take() {
            return Ok(keys);
        }
        let _ = self.let_go.lock().unwrap().recv();
        Err(SourceError::new("the issuer", "it hangs"))
    }
}

#[tokio::test]
async fn an_issuer_that_hangs_holds_nobody_up_whose_key_is_known() {
    let (known, unknown) = (IssuerKey::p256("known"), IssuerKey::p256("unknown"));
    let (holding, let_go) = channel();
    let source = Arc::new(Hanging {
        keys: Mutex::new(Some(key_set(&[&known]))),
        let_go: Mutex::new(let_go),
    });
    let verifier = TokenVerifier::with_source(&config(), source, at(NOW)).unwrap();
    let long = |key: &IssuerKey| key.sign(&claims(json!({ "exp": NOW + 7200 })));
    let (of_known, of_unknown) = (long(&known), long(&unknown));
    for seconds in [600, 601, 631, 1300] {
        let identified = verifier.identify(&of_known, at(NOW + seconds));
        let identified = tokio::time::timeout(PATIENCE, identified).await;
        assert!(identified.expect("nobody waits").is_ok(), "{seconds}");
        // The reading in the background has begun by then.
        tokio::time::sleep(SHORT).await;
    }
    // A token of an unknown key waits for the issuer.
    let mut waiting = tokio::spawn({
        let verifier = verifier.clone();
        async move { verifier.identify(&of_unknown, at(NOW + 1301)).await }
    });
    let early = tokio::time::timeout(10 * SHORT, &mut waiting).await;
    assert!(early.is_err(), "{early:?}");
    drop(holding);
    assert_eq!(waiting.await.unwrap(), Err(TokenError::UnknownKey));
}

/// Keys of an issuer and API keys are for two kinds of clients, who may both come.
#[tokio::test]
async fn an_issuer_makes_tokens_needed_beside_api_keys() {
    let key = IssuerKey::p256("p");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.json");
    std::fs::write(&file, key_set(&[&key])).unwrap();
    let jwt = JwtConfig {
        jwt_keys: Some(file.display().to_string()),
        ..config()
    };
    let mut access = AccessConfig {
        jwt,
        ..AccessConfig::default()
    };
    let everywhere = "0.0.0.0:8080".parse().unwrap();
    let load = |config: &AccessConfig| Access::load(config, everywhere, at(NOW));
    let alone = load(&access).unwrap();
    assert!(alone.is_needed() && !alone.keys.are_needed());
    let named = |name: &str| Credential {
        owner: Owner::named(name),
        ..Credential::default()
    };
    let holds = |access: &Access, name: &str| access.holds(&named(name), at(NOW));
    assert!(holds(&alone, "jwt:camera") && !holds(&alone, "camera"));

    access.api_keys = vec![Secret::from("camera:0123456789abcdef")];
    let both = load(&access).unwrap();
    assert!(holds(&both, "jwt:camera") && holds(&both, "camera"));
    let token = key.sign(&claims(json!({ "sub": "camera" })));
    let of_token = both.identify(&token, at(NOW)).await;
    let of_camera = Credential {
        until: Some(at(NOW + 360)),
        ..named("jwt:camera")
    };
    assert_eq!(of_token, Ok(of_camera.clone()));
    assert!(both.holds(&of_camera, at(NOW + 359)) && !both.holds(&of_camera, at(NOW + 360)));
    let of_key = both.identify("0123456789abcdef", at(NOW)).await.unwrap();
    assert_eq!(of_key.owner, Owner::named("camera"));
    assert!(of_key.key.is_some() && both.holds(&of_key, at(NOW + 10_000)));
    let of_another = both.identify("fedcba9876543210", at(NOW)).await;
    assert_eq!(of_another, Err(NotIdentified::Token(TokenError::Form)));

    access.no_auth = true;
    let contradiction = load(&access).unwrap_err();
    assert!(
        matches!(contradiction, AccessError::Contradiction),
        "{contradiction}"
    );
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
    // Reading a pipe to which nobody writes would never end.
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
