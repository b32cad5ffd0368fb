//! The service over a real socket, with a real client.

mod application;
mod binary;
mod capacity;
mod connections;
mod expiry;
mod flow;
mod footage;
mod forms;
mod openapi;
mod pictures;
mod problems;
mod provoke;
mod raw;
mod replay;
mod snapshots;
