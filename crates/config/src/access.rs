//! The settings of who may use the service: its keys, and the tokens of an identity provider.

use super::settings::{Secret, hosts, settings};
use std::path::PathBuf;

settings! {
    /// Who may use the service. Secrets are better given by variables and files than by flags, which other users of the
    /// machine can see.
    pub struct AccessConfig {
        # "Access and keys"
        /// API keys as `name:key`, separated by commas. A key has 16 to 256 visible characters.
        api_keys: Vec<Secret> = Vec::new(), as "NAME:KEY";
        /// File with an API key a line, as `name:key`; lines that begin with # are left out. Read again on SIGHUP.
        api_keys_file: Option<PathBuf> = None;
        /// Serve everybody who can reach the address. Without API keys only this machine is served otherwise.
        no_auth: bool = false;
        /// Hosts that requests may name, like `example.org` or `example.org:8443`, separated by commas [default: all;
        /// the names and addresses of this machine for a service on a loopback address without API keys and trusted
        /// proxies]. `/healthz`, `/readyz` and `/metrics` answer under any.
        allowed_hosts: Vec<String> = Vec::new(), |values| hosts(values);
        /// Secrets of at least 16 characters that snapshots and session tokens are signed with, separated by commas:
        /// the first signs, all are accepted. Without one, those of other processes are refused.
        snapshot_keys: Vec<Secret> = Vec::new(), as "SECRET";
        /// Key that alone reads `/metrics`, at least 16 characters [default: every API key does].
        metrics_key: Option<Secret> = None, as "KEY";
        /// Accept snapshots that are not signed with a secret, and sign none where no secret is given.
        unsigned_snapshots: bool = false;
    }
    flattened {
        /// Whose tokens are taken beside API keys.
        #[cfg(feature = "jwt")]
        jwt: JwtConfig;
    }
}

#[cfg(feature = "jwt")]
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
