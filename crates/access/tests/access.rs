//! Who may use a service with these settings.

use bagtrack_access::{
    Access, AccessError, AllowedHosts, ApiKeys, Credential, KeysError, NotIdentified, SessionToken,
};
use bagtrack_config::{AccessConfig, Config, Secret};
use bagtrack_sessions::{Owner, SessionName};
use std::fs;
use std::net::SocketAddr;
use std::time::{Duration, SystemTime};
use uuid::Uuid;

const KEY: &str = "0123456789abcdef";
const OTHER: &str = "fedcba9876543210";

fn address(text: &str) -> SocketAddr {
    text.parse().unwrap()
}

fn load(config: &AccessConfig, listen: SocketAddr) -> Result<Access, AccessError> {
    Access::load(config, listen, SystemTime::UNIX_EPOCH)
}

fn with_key() -> AccessConfig {
    AccessConfig {
        api_keys: vec![Secret::from(format!("me:{KEY}").as_str())],
        ..AccessConfig::default()
    }
}

fn of_key(owner: &str, key: &str) -> Credential {
    Credential {
        owner: Owner::named(owner),
        key: Some(blake3::hash(key.as_bytes())),
        until: None,
    }
}

#[test]
fn a_service_without_keys_is_for_this_machine_or_says_that_it_is_for_all() {
    let (here, everywhere) = (address("127.0.0.1:8080"), address("0.0.0.0:8080"));
    let none = AccessConfig::default();
    assert!(!load(&none, here).unwrap().keys.are_needed());
    let open = load(&none, everywhere).unwrap_err();
    assert!(
        matches!(open, AccessError::Open(at) if at == everywhere),
        "{open}"
    );
    for variable in ["BAGTRACK_API_KEYS", "BAGTRACK_NO_AUTH"] {
        assert!(open.to_string().contains(variable), "{open}");
    }
    let no_auth = AccessConfig {
        no_auth: true,
        ..AccessConfig::default()
    };
    assert!(!load(&no_auth, everywhere).unwrap().keys.are_needed());
    assert!(load(&with_key(), everywhere).unwrap().keys.are_needed());
    let both = AccessConfig {
        no_auth: true,
        ..with_key()
    };
    let contradiction = load(&both, here).unwrap_err();
    assert!(
        matches!(contradiction, AccessError::Contradiction),
        "{contradiction}"
    );
}

#[tokio::test]
async fn a_key_speaks_for_its_owner_where_keys_are_needed() {
    let here = address("127.0.0.1:8080");
    let open = load(&AccessConfig::default(), here).unwrap();
    assert!(!open.is_needed() && open.holds(&Credential::default(), SystemTime::UNIX_EPOCH));
    let closed = load(&with_key(), here).unwrap();
    assert!(closed.is_needed());
    let identify = async |key| closed.identify(key, SystemTime::UNIX_EPOCH).await;
    assert_eq!(identify(KEY).await, Ok(of_key("me", KEY)));
    assert_eq!(identify(OTHER).await, Err(NotIdentified::Key));
    let holds = |credential| closed.holds(&credential, SystemTime::UNIX_EPOCH);
    assert!(holds(of_key("me", KEY)));
    assert!(!holds(of_key("you", KEY)) && !holds(of_key("me", OTHER)));
    assert!(!holds(Credential::default()));
}

#[test]
fn a_session_token_ends_with_the_key_that_made_it_though_another_has_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys");
    let write = |text: &str| fs::write(&file, text).unwrap();
    write(&format!("me:{KEY}\nme:{OTHER}"));
    let config = AccessConfig {
        api_keys_file: Some(file.clone()),
        ..AccessConfig::default()
    };
    let access = load(&config, address("127.0.0.1:8080")).unwrap();
    let session = SessionName {
        id: Uuid::from_u128(7),
        incarnation: 11,
    };
    let now = SystemTime::UNIX_EPOCH;
    let expires = now + Duration::from_secs(60);
    let token = |key: Option<&str>| {
        access.tokens.sign(&SessionToken {
            session,
            owner: Owner::named("me"),
            key: key.map(|key| blake3::hash(key.as_bytes())),
            expires,
        })
    };
    let (old, new, of_earlier_version) = (token(Some(KEY)), token(Some(OTHER)), token(None));
    let taken = |token: &str| access.session_token(token, now);
    let with = |key| Credential {
        until: Some(expires),
        ..of_key("me", key)
    };
    assert_eq!(taken(&old), Some((session, with(KEY))));
    write(&format!("me:{OTHER}"));
    assert_eq!(access.keys.reload().unwrap(), 1);
    assert_eq!(taken(&old), None);
    assert!(!access.holds(&with(KEY), now), "a stream that is open");
    assert_eq!(taken(&new), Some((session, with(OTHER))));
    assert!(taken(&of_earlier_version).is_some());
    write(&format!("you:{OTHER}"));
    access.keys.reload().unwrap();
    assert_eq!(taken(&new), None);
    assert_eq!(taken(&of_earlier_version), None);
}

#[test]
fn secrets_have_sixteen_characters() {
    let here = address("127.0.0.1:8080");
    for (secret, is_long) in [(KEY, true), (&KEY[1..], false)] {
        let snapshots = AccessConfig {
            snapshot_keys: vec![Secret::from(OTHER), Secret::from(secret)],
            ..AccessConfig::default()
        };
        let metrics = AccessConfig {
            metrics_key: Some(Secret::from(secret)),
            ..AccessConfig::default()
        };
        for config in [snapshots, metrics] {
            match load(&config, here) {
                Ok(_) => assert!(is_long),
                Err(error) => {
                    assert!(
                        !is_long && matches!(error, AccessError::ShortSecret),
                        "{error}"
                    );
                    assert!(error.to_string().contains("BAGTRACK_SNAPSHOT_KEYS"));
                }
            }
        }
    }
}

#[test]
fn snapshots_are_signed_where_there_is_a_secret() {
    let here = address("127.0.0.1:8080");
    let secret = || vec![Secret::from(KEY)];
    let unsigned = AccessConfig {
        unsigned_snapshots: true,
        ..AccessConfig::default()
    };
    let unsigned = load(&unsigned, here).unwrap().snapshots.sign(b"a snapshot");
    for (snapshot_keys, unsigned_snapshots, takes_unsigned, signs) in [
        (vec![], false, false, true),
        (secret(), false, false, true),
        (vec![], true, true, false),
        (secret(), true, true, true),
    ] {
        let config = AccessConfig {
            snapshot_keys,
            unsigned_snapshots,
            ..AccessConfig::default()
        };
        let keys = load(&config, here).unwrap().snapshots;
        let code = keys.sign(b"a snapshot");
        assert_eq!(keys.verify(b"a snapshot", &unsigned), takes_unsigned);
        assert_eq!(code != unsigned, signs);
        assert!(keys.verify(b"a snapshot", &code));
    }
}

#[test]
fn keys_of_settings_and_file_are_read_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys");
    fs::write(&file, format!("# people\n\n  you:{OTHER}  \n")).unwrap();
    let texts = [Secret::from(format!("me:{KEY}").as_str())];
    let keys = ApiKeys::load(&texts, Some(&file)).unwrap();
    let owner = |key: &str| keys.owner(key.as_bytes()).map(|(owner, _)| owner);
    let count = |name| keys.of(&Owner::named(name)).len();
    assert_eq!(owner(KEY), Some(Owner::named("me")));
    assert_eq!(owner(OTHER), Some(Owner::named("you")));
    assert_eq!((count("me"), count("you"), count("they")), (1, 1, 0));

    // With the byte-order mark that some editors begin a text with.
    let again = format!("\u{feff}they:{OTHER}\nme:0000000000000000\n");
    fs::write(&file, again).unwrap();
    assert_eq!(keys.reload().unwrap(), 3);
    assert_eq!(owner(OTHER), Some(Owner::named("they")));
    assert_eq!((count("me"), count("you"), count("they")), (2, 0, 1));

    // A file that is refused changes nothing. No two clients may have one key.
    let of_two = [format!("they:{OTHER}\nwe:{OTHER}"), format!("we:{KEY}")];
    for (text, expected) in [
        (&of_two[0][..], "they and we"),
        (&of_two[1][..], "me and we"),
        ("# nobody\n", "has no key"),
        ("broken", "entry 1"),
        ("me:short", "entry 1"),
    ] {
        fs::write(&file, text).unwrap();
        let error = keys.reload().unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(owner(OTHER), Some(Owner::named("they")));
    }
    fs::remove_file(&file).unwrap();
    let gone = keys.reload().unwrap_err();
    assert!(matches!(gone, KeysError::File { .. }), "{gone}");
    fs::create_dir(&file).unwrap();
    let folder = keys.reload().unwrap_err();
    assert!(folder.to_string().contains("no regular file"), "{folder}");
    assert_eq!(count("me"), 2);
}

#[test]
fn a_file_alone_makes_keys_needed_and_has_to_have_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys");
    fs::write(&file, "").unwrap();
    let empty = ApiKeys::load(&[], Some(&file)).unwrap_err();
    assert!(matches!(empty, KeysError::Empty(_)), "{empty}");
    fs::write(&file, format!("you:{OTHER}")).unwrap();
    assert!(ApiKeys::load(&[], Some(&file)).unwrap().are_needed());
    assert!(!ApiKeys::load(&[], None).unwrap().are_needed());
}

#[test]
fn names_and_keys_have_their_lengths_and_signs() {
    let load = |text: &str| ApiKeys::load(&[Secret::from(text)], None);
    for name in ["a", "A-z_0.9", &"n".repeat(64)] {
        assert!(load(&format!("{name}:{KEY}")).is_ok(), "{name}");
    }
    for name in ["", "ä", "a/b", &"n".repeat(65)] {
        assert!(load(&format!("{name}:{KEY}")).is_err(), "{name}");
    }
    for length in [16, 256] {
        assert!(
            load(&format!("me:{}", "k".repeat(length))).is_ok(),
            "{length}"
        );
    }
    for length in [15, 257] {
        assert!(
            load(&format!("me:{}", "k".repeat(length))).is_err(),
            "{length}"
        );
    }
    assert!(load(&format!("me:{KEY} {KEY}")).is_err());
}

#[test]
fn only_a_service_for_this_machine_asks_for_its_names() {
    let hosts = |listen: &str, needs_key: bool, listed: &[&str], proxies: &[&str]| {
        let mut config = Config {
            listen: address(listen),
            ..Config::default()
        };
        config.access.allowed_hosts = listed.iter().map(ToString::to_string).collect();
        config.limits.trusted_proxies = proxies.iter().map(|text| text.parse().unwrap()).collect();
        let hosts = AllowedHosts::of(&config, needs_key);
        ["localhost", "example.org", "other.org"].map(|host| hosts.have(host))
    };
    let (here, everywhere) = ("127.0.0.1:8080", "0.0.0.0:8080");
    assert_eq!(hosts(here, false, &[], &[]), [true, false, false]);
    assert_eq!(hosts(here, true, &[], &[]), [true; 3]);
    assert_eq!(hosts(everywhere, false, &[], &[]), [true; 3]);
    assert_eq!(hosts(here, false, &[], &["10.0.0.0/8"]), [true; 3]);
    for listen in [here, everywhere] {
        assert_eq!(
            hosts(listen, false, &["example.org"], &[]),
            [false, true, false]
        );
    }
}
