//! Parts of the OpenAPI document that no type of the interface gives by itself.
//!
//! The document is generated from the handlers and from the types that they parse and send. Handlers take these shared
//! parts from here: [the frames of the examples](example_frames) and the [limits](create_description) of several
//! parameters together. The tracker's parameters, the problem responses and what follows from all calls together are
//! added to [the document](document), which is written in an order that generators of clients depend on.
//!
//! What can go wrong: the document says something else than the parsers do. So the bodies are made from the
//! [`Settings`](crate::requests::Settings) that the parsers read, and the parameters from the tracker's own table
//! and errors.

mod document;
pub mod example_frames;
mod key_order;
mod params_schema;
mod problem_responses;

pub use document::document;
pub use params_schema::create_description;
