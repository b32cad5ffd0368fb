//! What the client sends, and what it makes of the answers: against services that give the answers of a script.

mod exchanges;
mod retry;
mod script;
mod scripted_service;
