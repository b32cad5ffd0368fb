//! Session tokens: what a web page gets in place of an API key.
//!
//! A token holds the id of its session and the random number that this was opened with, the moment at which it ends, the
//! name of the key that made it, and a code of all of these under a secret of the service. So nothing is stored, and it
//! ends with its session (another one may have the id later), its time, its key or the secret.
//!
//! Layout, as base64url after [`PREFIX`]: 16 bytes of id, 8 of the incarnation, 8 of seconds since 1970 (both big
//! endian), 32 of code, and the name.

use bagtrack_sessions::{MAC_BYTES, MacKeys, Owner, SessionName};
use base64::Engine;
use base64::prelude::BASE64_URL_SAFE_NO_PAD;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use uuid::Uuid;

/// What every token begins with, and no usual key.
pub const PREFIX: &str = "bagtrack-session.";
const KEY_CONTEXT: &str = "bagtrack 2026-11 session token";
const ID_BYTES: usize = 16;
const INCARNATION_BYTES: usize = 8;
const TIME_BYTES: usize = 8;

/// What a token says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SessionToken {
    /// The only session that it is good for.
    pub session: SessionName,
    /// Whose session that is.
    pub owner: Owner,
    /// When it ends, in whole seconds.
    pub expires: SystemTime,
}

/// The keys of tokens.
#[derive(Debug)]
pub struct TokenKeys(MacKeys);

impl TokenKeys {
    /// Keys from these secrets; a random one without any.
    pub fn new<S: AsRef<[u8]>>(secrets: &[S]) -> Self {
        Self(MacKeys::new(KEY_CONTEXT, secrets))
    }

    /// The text of a token.
    pub fn sign(&self, token: &SessionToken) -> String {
        let seconds = token.expires.duration_since(UNIX_EPOCH).unwrap_or_default();
        let SessionName { id, incarnation } = token.session;
        let mut bytes = [&id.as_bytes()[..], &incarnation.to_be_bytes()].concat();
        bytes.extend_from_slice(&seconds.as_secs().to_be_bytes());
        let name = token.owner.name().unwrap_or("");
        let code = self.0.sign(&[&bytes, name.as_bytes()].concat());
        bytes.extend_from_slice(&code);
        bytes.extend_from_slice(name.as_bytes());
        format!("{PREFIX}{}", BASE64_URL_SAFE_NO_PAD.encode(bytes))
    }

    /// The token of a text, if it is one that these keys signed and that has not ended by `now`.
    pub fn verify(&self, text: &str, now: SystemTime) -> Option<SessionToken> {
        let text = text.strip_prefix(PREFIX)?;
        let bytes = BASE64_URL_SAFE_NO_PAD.decode(text).ok()?;
        let (id, rest) = bytes.split_first_chunk::<ID_BYTES>()?;
        let (incarnation, rest) = rest.split_first_chunk::<INCARNATION_BYTES>()?;
        let (seconds, rest) = rest.split_first_chunk::<TIME_BYTES>()?;
        let (code, name) = rest.split_first_chunk::<MAC_BYTES>()?;
        if !self
            .0
            .verify(&[&id[..], incarnation, seconds, name].concat(), code)
        {
            return None;
        }
        let expires = Duration::from_secs(u64::from_be_bytes(*seconds));
        let expires = UNIX_EPOCH.checked_add(expires)?;
        let owner = match std::str::from_utf8(name).ok()? {
            "" => Owner::default(),
            name => Owner::named(name),
        };
        (now < expires).then_some(SessionToken {
            session: SessionName {
                id: Uuid::from_bytes(*id),
                incarnation: u64::from_be_bytes(*incarnation),
            },
            owner,
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
        let token = SessionToken {
            session: SessionName {
                id: Uuid::from_u128(7),
                incarnation: 11,
            },
            owner: Owner::named("me"),
            expires,
        };
        let text = keys.sign(&token);
        let before = expires - Duration::from_secs(1);
        assert_eq!(keys.verify(&text, before), Some(token.clone()));
        let of_nobody = SessionToken {
            owner: Owner::default(),
            ..token
        };
        let text_of_nobody = keys.sign(&of_nobody);
        assert_eq!(keys.verify(&text_of_nobody, before), Some(of_nobody));
        assert_eq!(keys.verify(&text, expires), None);
        assert_eq!(TokenKeys::new(&["another"]).verify(&text, before), None);
        for position in PREFIX.len()..text.len() {
            let mut changed = text.clone().into_bytes();
            changed[position] = if changed[position] == b'A' {
                b'B'
            } else {
                b'A'
            };
            let changed = String::from_utf8(changed).unwrap();
            assert_eq!(keys.verify(&changed, before), None, "{position}");
        }
    }
}
