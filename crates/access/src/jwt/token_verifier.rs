//! Checks tokens with the keys of their issuer.

use super::key_set::{KeySet, KeySetError};
use super::key_source::{self, KeySource, SourceError};
use super::ring_provider;
use bagtrack_config::JwtConfig;
use bagtrack_sessions::Owner;
use jsonwebtoken::errors::ErrorKind;
use jsonwebtoken::{Algorithm, Header, Validation, decode, decode_header};
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

/// How far the clocks of issuer and service may be apart.
const LEEWAY: Duration = Duration::from_secs(60);
/// After this time the keys are read again, since the issuer may have revoked one.
const MAX_AGE: Duration = Duration::from_secs(600);
/// If the keys were not asked for in this time, a token waits until they are: one may have been revoked while no token
/// came.
const MAX_UNTRIED: Duration = Duration::from_secs(1200);
/// Least time between two readings for the sake of tokens that none of the keys has signed.
const MIN_AGE: Duration = Duration::from_secs(30);
/// Most tokens that are remembered, so that their signatures need not be checked again.
const MAX_CHECKED: usize = 1024;
/// The names of clients with such tokens begin with this. Names of API keys have no colon.
const PREFIX: &str = "jwt:";
/// The longest subject (OpenID Connect Core 1.0, section 2).
const MAX_OWNER_BYTES: usize = 255;

/// Why no tokens can be taken.
#[derive(Debug, thiserror::Error)]
pub enum JwtError {
    /// Settings are missing.
    #[error(
        "--jwt-issuer and --jwt-audience (BAGTRACK_JWT_ISSUER, BAGTRACK_JWT_AUDIENCE) go together, and --jwt-keys with them: \
         a token for other services must not be good for this one"
    )]
    Incomplete,
    /// The keys cannot be read.
    #[error("the keys of --jwt-issuer cannot be read (--jwt-keys, BAGTRACK_JWT_KEYS): {0}")]
    Source(#[from] SourceError),
    /// The text that was read is no key set.
    #[error("the keys of --jwt-issuer (--jwt-keys, BAGTRACK_JWT_KEYS) cannot be used: {0}")]
    Keys(#[from] KeySetError),
}

/// Why a token is not taken, for whoever sent it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TokenError {
    /// The text has another form.
    #[error("it is no API key of this service, and no JSON Web Token")]
    Form,
    /// The token's algorithm is not one of public keys.
    #[error("the token is signed with {0:?}, not with the issuer's key")]
    Algorithm(Algorithm),
    /// The token's header has critical parameters, and this service knows none (RFC 7515, section 4.1.11).
    #[error("the token's header has critical parameters (`crit`), and this service knows none")]
    Critical,
    /// The issuer has no key with the name and the algorithm of the token.
    #[error("the issuer has no key of the name and algorithm that the token says")]
    UnknownKey,
    /// The token was changed, or another key has signed it.
    #[error("the token's signature is wrong")]
    Signature,
    /// The token's time is over.
    #[error("the token has expired")]
    Expired,
    /// The token's time has not come.
    #[error("the token is not valid yet")]
    Early,
    /// The token is of another issuer.
    #[error("the token's issuer (`iss`) is not the one of this service")]
    Issuer,
    /// The token is for other audiences.
    #[error("the token is not for this service (`aud`)")]
    Audience,
    /// A claim is missing, or is not what it has to be.
    #[error("the token has no usable claim `{0}`")]
    Claim(String),
}

/// Whom a token speaks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// The client.
    pub owner: Owner,
    /// From then on the token is refused: its end plus a leeway of one minute for clocks that differ.
    pub expires: SystemTime,
}

/// Checks the tokens of one issuer. Clones share the keys.
#[derive(Debug, Clone)]
pub struct TokenVerifier(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    issuer: String,
    audience: Vec<String>,
    owner_claim: String,
    source: Arc<dyn KeySource>,
    known: Mutex<Known>,
    /// Held while the keys are read. Tokens that need newer keys wait for it.
    reading: tokio::sync::Mutex<()>,
}

/// The keys, and the tokens that they have signed.
#[derive(Debug)]
struct Known {
    keys: Arc<KeySet>,
    /// When the keys were asked for last, and when they came last.
    asked: SystemTime,
    came: SystemTime,
    /// Identities of tokens that these keys have signed, by the tokens' digests.
    checked: HashMap<blake3::Hash, Identity>,
}

impl TokenVerifier {
    /// A verifier by these settings, whose keys are read at once; `None` where no issuer is named. It may block.
    ///
    /// # Errors
    /// See [`JwtError`].
    pub fn load(config: &JwtConfig, now: SystemTime) -> Result<Option<Self>, JwtError> {
        let Some(issuer) = &config.jwt_issuer else {
            let is_empty = config.jwt_audience.is_empty() && config.jwt_keys.is_none();
            return if is_empty {
                Ok(None)
            } else {
                Err(JwtError::Incomplete)
            };
        };
        let source = key_source::named(config.jwt_keys.as_deref(), issuer);
        Self::with_source(config, source, now).map(Some)
    }

    /// A verifier by these settings, with keys from `source`. It may block.
    ///
    /// # Errors
    /// See [`JwtError`].
    pub fn with_source(
        config: &JwtConfig,
        source: Arc<dyn KeySource>,
        now: SystemTime,
    ) -> Result<Self, JwtError> {
        let issuer = config.jwt_issuer.clone().ok_or(JwtError::Incomplete)?;
        if config.jwt_audience.is_empty() {
            return Err(JwtError::Incomplete);
        }
        ring_provider::install();
        let keys = Arc::new(KeySet::parse(&source.read()?)?);
        Ok(Self(Arc::new(Inner {
            issuer,
            audience: config.jwt_audience.clone(),
            owner_claim: config.jwt_owner.clone(),
            source,
            known: Mutex::new(Known {
                keys,
                asked: now,
                came: now,
                checked: HashMap::new(),
            }),
            reading: tokio::sync::Mutex::new(()),
        })))
    }

    /// Whom this token speaks for. Keys that are old are read again in the background. If none of the keys has signed
    /// the token, they are read again first.
    ///
    /// # Errors
    /// See [`TokenError`].
    pub async fn identify(&self, token: &str, now: SystemTime) -> Result<Identity, TokenError> {
        let header = decode_header(token).map_err(|_| TokenError::Form)?;
        let (keys, asked, came) = {
            let known = self.known();
            (known.keys.clone(), known.asked, known.came)
        };
        if since(asked, now) >= MAX_UNTRIED {
            self.read_keys(&keys, now).await;
        } else if since(came, now) >= MAX_AGE && self.is_due(&keys, now) {
            // An issuer that is away or hangs must not delay tokens whose key is known.
            let (verifier, keys) = (self.clone(), keys.clone());
            tokio::spawn(async move { verifier.read_keys(&keys, now).await });
        }
        let identity = self.look_up(token, &header, now);
        // The issuer may have a new key, or another one under the same name.
        let (Err(TokenError::UnknownKey) | Err(TokenError::Signature)) = identity else {
            return identity;
        };
        self.read_keys(&keys, now).await;
        self.look_up(token, &header, now)
    }

    /// Whom the token speaks for by the keys that are known.
    fn look_up(
        &self,
        token: &str,
        header: &Header,
        now: SystemTime,
    ) -> Result<Identity, TokenError> {
        let digest = blake3::hash(token.as_bytes());
        let (keys, checked) = {
            let known = self.known();
            (known.keys.clone(), known.checked.get(&digest).cloned())
        };
        if let Some(identity) = checked {
            return match now < identity.expires {
                true => Ok(identity),
                false => Err(TokenError::Expired),
            };
        }
        let identity = self.check(token, header, &keys, now)?;
        let mut known = self.known();
        // Keys that were read meanwhile may not have signed the token.
        if Arc::ptr_eq(&known.keys, &keys) {
            known.remember(digest, identity.clone(), now);
        }
        Ok(identity)
    }

    /// Whether a client of this name is one with such tokens.
    pub fn may_have(&self, owner: &Owner) -> bool {
        owner.name().is_some_and(|name| name.starts_with(PREFIX))
    }

    /// Reads the keys again, and returns their number. It may block.
    ///
    /// # Errors
    /// See [`JwtError`]. The keys then stay as they were.
    pub fn reload(&self, now: SystemTime) -> Result<usize, JwtError> {
        self.known().asked = now;
        let keys = KeySet::parse(&self.0.source.read()?)?;
        let count = keys.len();
        let mut known = self.known();
        (known.keys, known.came) = (Arc::new(keys), now);
        known.checked.clear();
        Ok(count)
    }

    /// Whether the keys may be read: they are still those `seen`, and the last try is at least [`MIN_AGE`] ago.
    fn is_due(&self, seen: &Arc<KeySet>, now: SystemTime) -> bool {
        let known = self.known();
        Arc::ptr_eq(&known.keys, seen) && since(known.asked, now) >= MIN_AGE
    }

    /// Reads the keys again, unless another call has replaced those `seen`, or has tried less than [`MIN_AGE`] ago.
    async fn read_keys(&self, seen: &Arc<KeySet>, now: SystemTime) {
        let _reading = self.0.reading.lock().await;
        if !self.is_due(seen, now) {
            return;
        }
        let verifier = self.clone();
        let read = tokio::task::spawn_blocking(move || verifier.reload(now)).await;
        match read {
            Ok(Ok(count)) => tracing::info!(count, "keys of the issuer read again"),
            Ok(Err(error)) => tracing::warn!(%error, "the issuer's keys stay as they were"),
            Err(error) => tracing::error!(%error, "the issuer's keys stay as they were"),
        }
    }

    fn check(
        &self,
        token: &str,
        header: &Header,
        keys: &KeySet,
        now: SystemTime,
    ) -> Result<Identity, TokenError> {
        use Algorithm::{HS256, HS384, HS512};
        if matches!(header.alg, HS256 | HS384 | HS512) {
            return Err(TokenError::Algorithm(header.alg));
        }
        if header.crit.is_some() {
            return Err(TokenError::Critical);
        }
        let key = keys.find(header.kid.as_deref(), header.alg);
        let key = key.ok_or(TokenError::UnknownKey)?;
        let mut validation = Validation::new(header.alg);
        validation.set_issuer(&[&self.0.issuer]);
        validation.set_audience(&self.0.audience);
        validation.set_required_spec_claims(&["exp", "iss", "aud"]);
        // The library would compare with the system's clock, and not with `now`.
        validation.validate_exp = false;
        let claims = decode::<Map<String, Value>>(token, &key.key, &validation);
        let claims = claims.map_err(|error| refusal(error.kind()))?.claims;
        self.identity(&claims, now)
    }

    fn identity(
        &self,
        claims: &Map<String, Value>,
        now: SystemTime,
    ) -> Result<Identity, TokenError> {
        // The library would also take an array that contains the issuer.
        if claims.get("iss").and_then(Value::as_str) != Some(&self.0.issuer) {
            return Err(TokenError::Issuer);
        }
        let expires = moment(claims, "exp")?.ok_or_else(|| missing("exp"))? + LEEWAY;
        if now >= expires {
            return Err(TokenError::Expired);
        }
        if moment(claims, "nbf")?.is_some_and(|begins| now + LEEWAY < begins) {
            return Err(TokenError::Early);
        }
        let claim = &self.0.owner_claim;
        let name = claims.get(claim).and_then(Value::as_str);
        let is_name = |name: &&str| {
            (1..=MAX_OWNER_BYTES).contains(&name.len()) && !name.contains(char::is_control)
        };
        let name = name.filter(is_name).ok_or_else(|| missing(claim))?;
        Ok(Identity {
            owner: Owner::named(&format!("{PREFIX}{name}")),
            expires,
        })
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        // Nothing panics while the lock is held.
        self.0.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    fn remember(&mut self, digest: blake3::Hash, identity: Identity, now: SystemTime) {
        if self.checked.len() >= MAX_CHECKED {
            self.checked.retain(|_, checked| now < checked.expires);
        }
        if self.checked.len() >= MAX_CHECKED {
            self.checked.clear();
        }
        self.checked.insert(digest, identity);
    }
}

/// The time since a moment; zero where the clock was set back.
fn since(moment: SystemTime, now: SystemTime) -> Duration {
    now.duration_since(moment).unwrap_or_default()
}

/// The moment of a claim in seconds since 1970; `None` where the token has no such claim. [`LEEWAY`] can be added to
/// the moment.
fn moment(claims: &Map<String, Value>, claim: &str) -> Result<Option<SystemTime>, TokenError> {
    let Some(value) = claims.get(claim) else {
        return Ok(None);
    };
    let since_1970 = value.as_f64().map(Duration::try_from_secs_f64);
    let since_1970 = since_1970.and_then(Result::ok);
    let moment = since_1970.and_then(|since| SystemTime::UNIX_EPOCH.checked_add(since));
    let moment = moment.filter(|moment| moment.checked_add(LEEWAY).is_some());
    moment.map(Some).ok_or_else(|| missing(claim))
}

fn missing(claim: &str) -> TokenError {
    TokenError::Claim(claim.to_owned())
}

/// Why a token is refused, in words that say what to do.
fn refusal(error: &ErrorKind) -> TokenError {
    match error {
        ErrorKind::InvalidSignature => TokenError::Signature,
        ErrorKind::InvalidIssuer => TokenError::Issuer,
        ErrorKind::InvalidAudience => TokenError::Audience,
        ErrorKind::MissingRequiredClaim(claim) | ErrorKind::InvalidClaimFormat(claim) => {
            missing(claim)
        }
        _ => TokenError::Form,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_tokens_are_remembered_and_those_that_ended_go_first() {
        let now = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000);
        let mut known = Known {
            keys: Arc::default(),
            asked: now,
            came: now,
            checked: HashMap::new(),
        };
        let mut remember = |number: usize, expires: SystemTime, now: SystemTime| {
            let identity = Identity {
                owner: Owner::named("jwt:somebody"),
                expires,
            };
            known.remember(blake3::hash(&number.to_be_bytes()), identity, now);
            known.checked.len()
        };
        let (soon, later) = (now + LEEWAY, now + MAX_AGE);
        for number in 0..MAX_CHECKED {
            // The first token lives longer than the others.
            let expires = if number == 0 { later } else { soon };
            assert_eq!(remember(number, expires, now), number + 1);
        }
        assert_eq!(remember(MAX_CHECKED, later, soon), 2);
        for number in 2..MAX_CHECKED {
            assert_eq!(remember(MAX_CHECKED + number, later, soon), number + 1);
        }
        // All tokens live, so all are dropped.
        assert_eq!(remember(3 * MAX_CHECKED, later, soon), 1);
    }
}
