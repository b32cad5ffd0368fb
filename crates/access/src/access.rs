//! The keys and secrets of a running service, checked at its start, and whom a request speaks for.

#[cfg(feature = "jwt")]
use super::jwt::{JwtError, TokenError, TokenVerifier};
use super::keys::{ApiKeys, KeysError};
use super::token::TokenKeys;
use bagtrack_config::AccessConfig;
use bagtrack_sessions::{MacKeys, Owner, SNAPSHOT_KEY_CONTEXT, SessionName};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::SystemTime;

const MIN_SECRET_BYTES: usize = 16;

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// The API keys cannot be read.
    #[error(transparent)]
    Keys(#[from] KeysError),
    /// The tokens of an identity provider cannot be taken.
    #[cfg(feature = "jwt")]
    #[error(transparent)]
    Jwt(#[from] JwtError),
    /// The service would be open to a network.
    #[error(
        "{0} can be reached from other machines, and there are no API keys: give some (--api-keys-file, \
         BAGTRACK_API_KEYS), or an issuer of tokens (--jwt-issuer), or say that everybody may use the service (--no-auth, BAGTRACK_NO_AUTH=true)"
    )]
    Open(SocketAddr),
    /// Two settings contradict each other.
    #[error(
        "there are API keys or an issuer of tokens, and --no-auth (BAGTRACK_NO_AUTH) says that none is needed: leave one of them out"
    )]
    Contradiction,
    /// A secret can be guessed.
    #[error(
        "--snapshot-keys (BAGTRACK_SNAPSHOT_KEYS) and --metrics-key (BAGTRACK_METRICS_KEY) must be secrets of at least \
         {MIN_SECRET_BYTES} characters"
    )]
    ShortSecret,
}

/// What a request was let in with.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Credential {
    /// The client whose sessions the credential opens.
    pub owner: Owner,
    /// The digest of the presented API key, or of the one with which the session token was made.
    pub key: Option<blake3::Hash>,
    /// When the credential ends; `None` for an API key.
    pub until: Option<SystemTime>,
}

/// The keys and secrets of a running service.
#[derive(Debug)]
pub struct Access {
    /// The API keys.
    pub keys: ApiKeys,
    /// The verifier of an identity provider's tokens, where the settings name a provider.
    #[cfg(feature = "jwt")]
    pub jwt: Option<TokenVerifier>,
    /// The keys with which session tokens are signed.
    pub tokens: TokenKeys,
    /// The keys with which snapshots are signed.
    pub snapshots: Arc<MacKeys>,
}

impl Access {
    /// The keys and secrets of these settings, for a service that listens on this address. It may block, since it reads
    /// the keys of the issuer.
    ///
    /// # Errors
    /// See [`AccessError`].
    #[cfg_attr(
        not(feature = "jwt"),
        expect(unused_variables, reason = "nothing is as old as its keys")
    )]
    pub fn load(
        config: &AccessConfig,
        listen: SocketAddr,
        now: SystemTime,
    ) -> Result<Self, AccessError> {
        let keys = ApiKeys::load(&config.api_keys, config.api_keys_file.as_deref())?;
        let is_needed = keys.are_needed();
        #[cfg(feature = "jwt")]
        let is_needed = is_needed || config.jwt.jwt_issuer.is_some();
        match (is_needed, config.no_auth) {
            (true, true) => return Err(AccessError::Contradiction),
            (false, false) if !listen.ip().is_loopback() => return Err(AccessError::Open(listen)),
            _ => {}
        }
        let secrets = &config.snapshot_keys;
        let is_short = |secret: &_| AsRef::<[u8]>::as_ref(secret).len() < MIN_SECRET_BYTES;
        if secrets.iter().chain(&config.metrics_key).any(is_short) {
            return Err(AccessError::ShortSecret);
        }
        let mut snapshots = MacKeys::new(SNAPSHOT_KEY_CONTEXT, secrets);
        if config.unsigned_snapshots {
            snapshots = snapshots.accepting_unsigned(!secrets.is_empty());
        }
        Ok(Self {
            keys,
            #[cfg(feature = "jwt")]
            jwt: TokenVerifier::load(&config.jwt, now)?,
            tokens: TokenKeys::new(secrets),
            snapshots: Arc::new(snapshots),
        })
    }

    /// Whether a key or a token is needed to use the service.
    pub fn is_needed(&self) -> bool {
        #[cfg(feature = "jwt")]
        if self.jwt.is_some() {
            return true;
        }
        self.keys.are_needed()
    }

    /// Whether a credential is still good: its API key still exists, and it has not ended by `now`.
    pub fn holds(&self, credential: &Credential, now: SystemTime) -> bool {
        let Credential { owner, key, until } = credential;
        if until.is_some_and(|until| now >= until) {
            return false;
        }
        if !self.is_needed() {
            return true;
        }
        #[cfg(feature = "jwt")]
        if self.jwt.as_ref().is_some_and(|jwt| jwt.may_have(owner)) {
            return true;
        }
        let keys = self.keys.of(owner);
        match key {
            Some(key) => keys.contains(key),
            None => !keys.is_empty(),
        }
    }

    /// The session that this session token is good for, and its credential. `None` unless the keys of this service
    /// signed the token and it is still good.
    pub fn session_token(&self, text: &str, now: SystemTime) -> Option<(SessionName, Credential)> {
        let token = self.tokens.verify(text, now, |owner| self.keys.of(owner))?;
        let credential = Credential {
            owner: token.owner,
            key: token.key,
            until: Some(token.expires),
        };
        self.holds(&credential, now)
            .then_some((token.session, credential))
    }

    /// The credential of an API key or of an identity provider's token.
    ///
    /// # Errors
    /// See [`NotIdentified`].
    #[cfg_attr(not(feature = "jwt"), expect(unused_variables, reason = "no key ends"))]
    pub async fn identify(
        &self,
        presented: &str,
        now: SystemTime,
    ) -> Result<Credential, NotIdentified> {
        if let Some((owner, digest)) = self.keys.owner(presented.as_bytes()) {
            return Ok(Credential {
                owner,
                key: Some(digest),
                until: None,
            });
        }
        #[cfg(feature = "jwt")]
        if let Some(jwt) = &self.jwt {
            let identity = jwt.identify(presented, now).await?;
            return Ok(Credential {
                owner: identity.owner,
                key: None,
                until: Some(identity.expires),
            });
        }
        Err(NotIdentified::Key)
    }
}

/// Why nobody is identified.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotIdentified {
    /// The service has no such key, and takes no tokens of an identity provider.
    #[error("it is no API key of this service")]
    Key,
    /// The token is not taken.
    #[cfg(feature = "jwt")]
    #[error(transparent)]
    Token(#[from] TokenError),
}
