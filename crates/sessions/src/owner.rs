//! Whose a session is.

use std::sync::Arc;

/// The client that a session belongs to: the name of its API key, or nobody where the service knows no keys. Others do
/// not see the session.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Owner(Option<Arc<str>>);

impl Owner {
    /// The client whose API key has this name.
    pub fn named(name: &str) -> Self {
        Self(Some(name.into()))
    }

    /// The name of the API key.
    pub fn name(&self) -> Option<&str> {
        self.0.as_deref()
    }
}
