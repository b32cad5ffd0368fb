//! What many clients, hostile or not, may take at once.

pub mod bombs;
pub mod capacity;
pub mod connections;
pub mod hostile_connections;
pub mod quotas;
pub mod shares;
