//! Parts of the OpenAPI document that no type of the interface gives by itself.
//!
//! The document is generated from the handlers and from the types that they parse and send. Handlers take these shared
//! parts from here: [the frames of the examples](example_frames) and [the limits](param_limits) of several
//! parameters together. [The tracker's parameters](params_schema), [the problem responses](problem_responses) and what
//! follows from all calls together are added to [the document](document),
//! which is written [in an order](key_order) that generators of clients depend on.
//!
//! What can go wrong: the document says something else than the parsers do. So the bodies are made from the
//! [`Settings`](bagtrack_api::requests::Settings) that the parsers read, and the parameters from the tracker's own table
//! and errors.

pub mod document;
pub mod example_frames;
mod key_order;
pub mod param_limits;
mod params_schema;
mod problem_responses;
