//! A simulated Redis: the scripts of the store are run by a real Lua over a map of keys with times to live.
//!
//! In: a script with its keys and arguments, over a [`Line`](line::Line) that loses, delays and doubles messages. Out:
//! what the script answers. [`Server`](server::Server) is away, slow and restarted as the [nemesis](crate::nemesis)
//! says.

pub mod keyspace;
pub mod line;
pub mod lua;
pub mod server;
