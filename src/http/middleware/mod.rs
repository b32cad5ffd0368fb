//! What requests pass through before their handlers. [`chain`] gives the order.
//!
//! In: a request. Out: the request, with what was found in its extensions, or a response in its place.
//!
//! What can go wrong: a client says that it is another (`X-Forwarded-For` counts only from a trusted proxy), or reads
//! no answer because it is still sending its body ([`request_body`]).

pub mod answer_problems;
pub mod authenticate;
pub mod base_path;
pub mod chain;
pub mod client_quotas;
pub mod host_and_origin;
pub mod request_body;
pub mod response_headers;
pub mod telemetry;
pub mod trace_context;
