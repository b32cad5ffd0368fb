//! The live sessions.
