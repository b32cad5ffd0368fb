//! The HTTP service bagtrack: it follows an object through the frames that clients upload. The first frame and a box
//! open a session; every further frame gets a box back.
//!
//! The tracker is the crate [`bagtrack_tracker`], which implements the paper *Bags of Affine Subspaces for Robust
//! Object Tracking*. This crate is the service around it, and the program `bagtrack`.
//!
//! | module | holds |
//! |---|---|
//! | [`http`] | the interface: routes, problem documents, the OpenAPI document |
//! | [`drawing`] | boxes and scores on a picture |
//!
//! | crate | holds |
//! |---|---|
//! | [`bagtrack_tracker`] | the paper, as a pure state machine: no async, no HTTP, no files, no clock |
//! | [`bagtrack_sessions`] | the acts on sessions, without HTTP: their store and their scheduler |
//! | [`bagtrack_ingest`] | JPEG, PNG and WebP files to frames, with limits that are checked before decoding |
//! | [`bagtrack_sample`] | synthetic clips with exact ground truth |
//!
//! Three features are on by default: `redis` has the store that replicas share, `tls` serves HTTPS and reaches a store
//! behind TLS, `jwt` takes the tokens of an identity provider. `turbo` decodes JPEGs with libjpeg-turbo, `otel` exports
//! spans.
//!
//! Data goes one way, `http -> sessions -> ingest -> tracker`, and the answer comes back the same way.

pub mod drawing;
pub mod http;

/// The lines of Rust in the README, which have to compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
