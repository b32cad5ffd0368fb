//! Parts of the OpenAPI document that no type of the interface gives by itself.
//!
//! The document is generated from the handlers and from the types that they parse and send. Handlers take these shared
//! parts from here: [the bodies](request_bodies) with frames and settings,
//! [the frames of the examples](example_frames), [the tracker's parameters](params_schema) and
//! [their limits together](param_limits). [The problem responses](problem_responses) and
//! what follows from all calls together are added to [the document](document),
//! which is written [in an order](key_order) that generators of clients depend on.
//!
//! What can go wrong: the document says something else than the parsers do. So the bodies are made from the
//! [`Settings`](crate::http::extract::settings::Settings) type that the parsers read, and the parameters from the tracker's own table and
//! errors.

pub mod document;
pub mod example_frames;
mod key_order;
pub mod param_limits;
pub mod params_schema;
mod problem_responses;
pub mod request_bodies;
