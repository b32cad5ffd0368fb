//! The service as a whole: it listens, gives each connection its routes, and ends in order.
//!
//! In: the settings. Out: an [`Application`](application::Application). [`router`] has all routes.
//!
//! What can go wrong: there is no room for a connection, and its client is [told so](connections); a client does not
//! end its connection when the service ends, and is cut off.

pub mod application;
pub mod connections;
pub mod router;
pub mod service;
