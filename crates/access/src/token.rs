//! Session tokens: what a web page gets in place of an API key.
//!
//! A token holds the session's id and incarnation, the moment at which the token ends, the name of the API key that
//! made it, and a code of all of these and of the key under a secret of the service. So the service stores nothing, and
//! the token ends with its session (another one may get the id later), its time, its key or the secret.
//!
//! Layout, as base64url after [`PREFIX`]: 16 bytes of id, 8 of the incarnation, 8 of seconds since 1970 (both big
//! endian), 32 of code, and the name.

use bagtrack_sessions::{MAC_BYTES, MacKeys, Owner, SessionName};
use base64::Engine;
use base64::prelude::BASE64_URL_SAFE_NO_PAD;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use uuid::Uuid;

/// Every token begins with this, and no API key may.
pub const PREFIX: &str = "bagtrack-session.";
const CONTEXT: &str = "bagtrack 2026-11 session token";
const WITH_KEY_CONTEXT: &str = "bagtrack 2026-11 session token of an API key";
const ID_BYTES: usize = 16;
const INCARNATION_BYTES: usize = 8;
const TIME_BYTES: usize = 8;

/// What a token says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SessionToken {
    /// The only session that the token is good for.
    pub session: SessionName,
    /// The owner of that session.
    pub owner: Owner,
    /// The digest of the API key with which the token was made. `None` where it was made with an identity provider's
    /// token, without a key, or by a version that wrote no keys into tokens.
    pub key: Option<blake3::Hash>,
    /// When the token ends, in whole seconds.
    pub expires: SystemTime,
}

/// The keys of tokens.
#[derive(Debug)]
pub struct TokenKeys {
    /// Keys for tokens that were made without an API key.
    plain: MacKeys,
    with_key: MacKeys,
}

impl TokenKeys {
    /// Keys from these secrets; a random key where there are none.
    pub fn new<S: AsRef<[u8]>>(secrets: &[S]) -> Self {
        Self {
            plain: MacKeys::new(CONTEXT, secrets),
            with_key: MacKeys::new(WITH_KEY_CONTEXT, secrets),
        }
    }

    /// The text of a token.
    pub fn sign(&self, token: &SessionToken) -> String {
        let seconds = token.expires.duration_since(UNIX_EPOCH).unwrap_or_default();
        let SessionName { id, incarnation } = token.session;
        let mut bytes = [&id.as_bytes()[..], &incarnation.to_be_bytes()].concat();
        bytes.extend_from_slice(&seconds.as_secs().to_be_bytes());
        let name = token.owner.name().unwrap_or("");
        let code = match &token.key {
            None => self.plain.sign(&[&bytes, name.as_bytes()].concat()),
            Some(key) => self
                .with_key
                .sign(&[key.as_bytes(), &bytes[..], name.as_bytes()].concat()),
        };
        bytes.extend_from_slice(&code);
        bytes.extend_from_slice(name.as_bytes());
        format!("{PREFIX}{}", BASE64_URL_SAFE_NO_PAD.encode(bytes))
    }

    /// The token of a text, if it is one that these keys signed and that has not ended by `now`. `keys_of` gives the
    /// digests of an owner's API keys; the token must have been made with one of these, or without a key.
    pub fn verify(
        &self,
        text: &str,
        now: SystemTime,
        keys_of: impl FnOnce(&Owner) -> Vec<blake3::Hash>,
    ) -> Option<SessionToken> {
        let text = text.strip_prefix(PREFIX)?;
        let bytes = BASE64_URL_SAFE_NO_PAD.decode(text).ok()?;
        let (id, rest) = bytes.split_first_chunk::<ID_BYTES>()?;
        let (incarnation, rest) = rest.split_first_chunk::<INCARNATION_BYTES>()?;
        let (seconds, rest) = rest.split_first_chunk::<TIME_BYTES>()?;
        let (code, name) = rest.split_first_chunk::<MAC_BYTES>()?;
        let message = [&id[..], incarnation, seconds, name].concat();
        let owner = match std::str::from_utf8(name).ok()? {
            "" => Owner::default(),
            name => Owner::named(name),
        };
        let key = match self.plain.verify(&message, code) {
            true => None,
            false => Some(keys_of(&owner).into_iter().find(|key| {
                let message = [&key.as_bytes()[..], &message].concat();
                self.with_key.verify(&message, code)
            })?),
        };
        let expires = Duration::from_secs(u64::from_be_bytes(*seconds));
        let expires = UNIX_EPOCH.checked_add(expires)?;
        (now < expires).then_some(SessionToken {
            session: SessionName {
                id: Uuid::from_bytes(*id),
                incarnation: u64::from_be_bytes(*incarnation),
            },
            owner,
            key,
            expires,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_holds_for_its_session_until_its_end_and_cannot_be_changed() {
        let keys = TokenKeys::new(&["a secret"]);
        let expires = UNIX_EPOCH + Duration::from_secs(1_000_000);
        let before = expires - Duration::from_secs(1);
        let (own, other) = (blake3::hash(b"my key"), blake3::hash(b"another key"));
        for (owner, key) in [
            (Owner::named("me"), Some(own)),
            (Owner::named("me"), None),
            (Owner::default(), None),
        ] {
            let session = SessionName {
                id: Uuid::from_u128(7),
                incarnation: 11,
            };
            let token = SessionToken {
                session,
                owner: owner.clone(),
                key,
                expires,
            };
            let text = keys.sign(&token);
            let of_owner = |asked: &Owner| {
                assert_eq!(*asked, owner);
                vec![other, own]
            };
            assert_eq!(keys.verify(&text, before, of_owner), Some(token));
            assert_eq!(keys.verify(&text, expires, of_owner), None);
            let taken = keys.verify(&text, before, |_| vec![other]);
            assert_eq!(taken.is_none(), key.is_some(), "its key is gone");
            let of_another = TokenKeys::new(&["another"]);
            assert_eq!(of_another.verify(&text, before, of_owner), None);
            for position in PREFIX.len()..text.len() {
                let mut changed = text.clone().into_bytes();
                changed[position] = match changed[position] {
                    b'A' => b'B',
                    _ => b'A',
                };
                let changed = String::from_utf8(changed).unwrap();
                let taken = keys.verify(&changed, before, |_| vec![other, own]);
                assert_eq!(taken, None, "{position}");
            }
        }
    }
}
