//! The settings of tokens that an identity provider gives.

use super::settings::settings;

settings! {
    /// Whose tokens are taken beside API keys: JSON Web Tokens (RFC 7519), of OpenID Connect or OAuth 2.0.
    pub struct JwtConfig {
        # "Access and keys"
        /// Take the JSON Web Tokens of this issuer too: its address, as their claim `iss` has it.
        jwt_issuer: Option<String> = None, as "URL";
        /// Whom those tokens must be for, separated by commas: one of these is among their claim `aud`.
        jwt_audience: Vec<String> = Vec::new(), as "AUDIENCE";
        /// The keys that sign them: a file or an address with a JSON Web Key Set [default: what the issuer names at
        /// /.well-known/openid-configuration]. Read again when none of them has signed a token, every ten minutes, and
        /// on SIGHUP.
        jwt_keys: Option<String> = None, as "FILE|URL";
        /// The claim that names the client: its sessions and quotas belong to what it says.
        jwt_owner: String = "sub".to_owned(), as "CLAIM";
    }
}
