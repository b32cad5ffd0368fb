//! Tokens of an identity provider: JSON Web Tokens (RFC 7519), as OpenID Connect and OAuth 2.0 (RFC 9068) give them.
//!
//! In: a token. Out: the [`Identity`] that it speaks for, or why it is not taken ([`TokenError`]). Only tokens of one
//! issuer, for one of the audiences named, signed by one of the issuer's public keys are taken (RFC 8725). The keys are
//! a [`KeySet`](key_set::KeySet), which comes from a [`KeySource`].
//!
//! What can go wrong: a token is signed with a key that the service may know but the issuer did not mean (only public
//! keys count, and each with its own algorithms); the issuer changes its keys (they are read again when none of them
//! has signed a token, and every ten minutes); the issuer is out of reach (the former keys stay, and only tokens that
//! none of them signed wait); somebody invents tokens to make the service read the keys again and again (it does so at
//! most every half minute).

mod key_set;
mod key_source;
mod ring_provider;
mod token_verifier;

pub use key_set::KeySetError;
pub use key_source::{KeySource, SourceError};
pub use token_verifier::{Identity, JwtError, TokenError, TokenVerifier};
