//! The service over a real socket, with a real client.

mod application;
mod binary;
mod bombs;
mod capacity;
mod connections;
mod expiry;
mod flow;
mod footage;
mod forms;
mod heavy;
mod hostile_connections;
mod openapi;
mod pictures;
mod problems;
mod provoke;
mod quotas;
mod raw;
mod replay;
mod snapshots;
mod uploads;
