//! The service over TLS: with certificates made here, and with those of openssl and curl as the client.

mod certificates;
mod client;
mod curl;
mod hostile;
mod program;
mod session;
